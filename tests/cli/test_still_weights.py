"""Morph weights that move no vertex, as of targets with normals only: their error is bounded and stated."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip, Track
from anim.sampling.track import sample
from tests.cli.conftest import Call
from tests.cli.running_recipes import write_recipe
from tests.files import glb_of, opened_fixture, opened_path

TIMES = np.arange(21) / 30
NOISE = np.random.default_rng(4).random((len(TIMES), 1))
STILL, MOVING = "NORMAL", "POSITION"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cube with targets without positions, still.glb, and one with a target that moves it too, mixed.glb."""
    monkeypatch.chdir(tmp_path)
    steady = np.linspace(0, 1, len(TIMES))[:, None]
    for name, attributes, second in (("still", (STILL, STILL), NOISE[::-1]), ("mixed", (STILL, MOVING), steady)):
        data = glb_of(_document(attributes, np.concatenate([NOISE, second], axis=1)))
        (tmp_path / f"{name}.glb").write_bytes(data)
    return tmp_path


def _document(attributes: tuple[str, str], weights: Floats) -> Document:
    document = opened_fixture("pointer")
    primitive: dict[str, Any] = dict(document.json["meshes"][0]["primitives"][0])
    primitive["targets"] = [{name: i} for name, i in zip(attributes, (3, 4), strict=True)]
    meshes = [{**document.json["meshes"][0], "primitives": [primitive]}]
    json = {**document.json, "meshes": meshes, "animations": document.json["animations"][:1]}
    track = Track(0, "weights", "LINEAR", TIMES, weights)
    return writer.replace_clips(Document(json, document.buffers), {0: Clip("morph", (track,))})


def _weight_errors(path: Path) -> Floats:
    """The largest error of each weight (M,)."""
    (clip,) = reader.clips(opened_path(path))
    times = np.linspace(0, TIMES[-1], 2001)
    first = np.interp(times, TIMES, NOISE[:, 0])
    second = np.linspace(0, 1, 2001)
    return np.asarray(np.abs(sample(clip.tracks[0], times) - np.stack([first, second], axis=1)).max(axis=0))


@pytest.mark.parametrize("name", ["still", "mixed"])
def test_edits_state_the_error(name: str, folder: Path, call: Call) -> None:
    line = call("resample", f"{name}.glb", "out.glb", "--fps", "4").err
    assert "of range at the weights of 'turning'" in line
    percent = float(line.split("pointers max ")[1].split()[0])
    largest = _weight_errors(folder / "out.glb")[0]
    assert percent >= 98 * largest / np.ptp(NOISE) > 10


def test_optimize_keeps_the_bound_of_tracks_that_move_nothing(folder: Path, call: Call) -> None:
    for fraction in (1e-4, 0.2):
        options = "--max-error", "1%", "--max-pointer-error", str(fraction), "--report", "-"
        report = json.loads(call("optimize", "mixed.glb", "out.glb", *options).product())
        error = _weight_errors(folder / "out.glb")[0]
        assert error <= 1.001 * fraction * np.ptp(NOISE)
        assert report["clips"][0]["max_pointer_error"] == pytest.approx(error / np.ptp(NOISE), rel=0.02, abs=1e-6)


def test_optimize_keeps_still_weights_exact(folder: Path, call: Call) -> None:
    call("optimize", "mixed.glb", "out.glb", "--max-error", "1%", "--max-pointer-error", "0")
    assert _weight_errors(folder / "out.glb")[0] <= 1e-5


def test_a_still_weight_away_from_rest_is_not_dropped(folder: Path, call: Call) -> None:
    weights = np.tile([0.5, 0.0], (len(TIMES), 1))
    Path("constant.glb").write_bytes(glb_of(_document((STILL, MOVING), weights)))
    call("optimize", "constant.glb", "out.glb", "--max-error", "1%")
    (clip,) = reader.clips(opened_path(folder / "out.glb"))
    assert clip.tracks[0].values[0] == pytest.approx([0.5, 0.0], rel=1e-4)


@pytest.mark.parametrize("step", ["resample --fps 4", "optimize --max-error 1mm --max-pointer-error 50%"])
def test_a_run_states_it_too(step: str, folder: Path, call: Call) -> None:
    command, *options = step.split()
    line = call(command, "mixed.glb", "out.glb", *options).err
    write_recipe(folder, step, match="mixed.glb")
    words = line[line.index("pointers max ") : line.index("of 'turning'")]
    assert words in next(each for each in call("run").err.splitlines() if each.startswith("build/"))
