"""Files that animate a node with a `matrix`: every command opens them, says so, and writes what is valid."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fixtures.broken.pieces import animated, text
from tests.cli.conftest import Call
from tests.cli.running import refusal
from tests.files import opened
from tests.khronos import errors, needs_validator, validate

TURNED = [0, -2, 0, 0, 2, 0, 0, 0, 0, 0, 2, 0, 1, 2, 3, 1]  # −90° about z, twice as large, moved
NOTE = "node 0 'hip' has a matrix although a clip animates it: taken apart into translation, rotation and scale"


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    content = animated()
    content["nodes"] = [{"name": "hip", "matrix": TURNED, "children": [1]}, {"name": "hat", "matrix": TURNED}]
    path = tmp_path / "walk.gltf"
    path.write_bytes(text(content))
    return path


@needs_validator
@pytest.mark.parametrize(
    "line",
    [
        ("resample", "--fps", "10"),
        ("retime", "--speed", "2"),
        ("trim", "--to", "0.5"),
        ("ease", "--ease", "smoothstep"),
        ("spline", "--tangents", "natural"),
        ("optimize",),
        ("convert",),
    ],
)
def test_every_editing_command_opens_it_says_so_and_writes_valid_gltf(
    line: tuple[str, ...], call: Call, walk: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out.glb"
    run = call(line[0], walk, out, *line[1:])
    run.product()
    assert f"note: {walk}: {NOTE}\n" in run.err
    data = out.read_bytes()
    assert errors(validate(data)) == []
    hip, hat = opened(data).json["nodes"]
    assert "matrix" not in hip
    np.testing.assert_allclose(hip["rotation"], [0, 0, -np.sqrt(0.5), np.sqrt(0.5)], atol=1e-9)
    assert hip["scale"] == [2, 2, 2]
    assert hat == {"name": "hat", "matrix": TURNED}


def test_commands_that_only_look_open_it_too(call: Call, walk: Path, tmp_path: Path) -> None:
    for line in (["sample", "--at", "0", "--format", "csv"], ["loop"], ["to-euler", tmp_path / "a.json"]):
        run = call(line[0], walk, *line[1:])
        run.product()
        assert NOTE in run.err
    assert NOTE in call("diff", walk, walk).err
    assert call("resample", walk, tmp_path / "out.glb", "--fps", "9", "-q").err == ""


def test_inspect_reports_it_as_a_fault(call: Call, walk: Path) -> None:
    run = call("inspect", walk, "--format", "json")
    (file,) = json.loads(run.product())["files"]
    (found,) = [each for each in file["findings"] if each["name"] == "animated-matrix"]
    assert (found["severity"], found["where"]) == ("error", "node 0 'hip'")
    assert call("inspect", walk, "--fail-on", "error").code == 6


def test_a_shear_is_exit_3_with_advice(call: Call, walk: Path, tmp_path: Path) -> None:
    content = json.loads(walk.read_text())
    content["nodes"][0]["matrix"][5] = 1
    walk.write_text(json.dumps(content))
    run = call("resample", walk, tmp_path / "out.glb", "--fps", "9")
    assert "node 0 'hip': is animated and has a sheared matrix" in refusal(run, 3)
    assert run.err.splitlines()[1].startswith("help: ")
