"""Text with a byte order mark, as Excel and Notepad write it: read where standards allow it, and named in a glTF."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fixtures.broken.pieces import animated, glb, text
from tests.cli.conftest import Call
from tests.cli.running import built, help_line, refusal

MARK = b"\xef\xbb\xbf"
NAMED = "starts with a byte order mark (expected UTF-8 without one, as glTF requires)"


@pytest.mark.parametrize("ending", ["csv", "json", "bvh"])
def test_curves_are_read(ending: str, call: Call, tmp_path: Path) -> None:
    arm, curves = tmp_path / "arm.glb", tmp_path / f"arm.{ending}"
    arm.write_bytes(built("arm"))
    call("to-euler", arm, curves, "--clip", "bend", "--fps", "10").product()
    expected = call("from-euler", curves, "--onto", arm).product()
    curves.write_bytes(MARK + curves.read_bytes())
    assert call("from-euler", curves, "--onto", arm).product() == expected


@pytest.mark.parametrize("aliases", [b"lower,lower\n", b'{"lower": "lower"}'])
def test_pairs_of_joints_are_read(aliases: bytes, call: Call, tmp_path: Path) -> None:
    arm, curves, pairs = (tmp_path / name for name in ("arm.glb", "arm.csv", "pairs"))
    arm.write_bytes(built("arm"))
    call("to-euler", arm, curves, "--clip", "bend").product()
    pairs.write_bytes(MARK + aliases)
    call("from-euler", curves, tmp_path / "out.glb", "--onto", arm, "--alias", pairs).product()


def test_meshes_are_read(call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_bytes(MARK + b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    run = call("convert-cache", tmp_path / "a.obj", tmp_path / "a.npz")
    assert "1 frame of 3 vertices" in run.err


def test_settings_and_baselines_are_read(call: Call, tmp_path: Path) -> None:
    arm, settings, baseline = (tmp_path / name for name in ("arm.glb", "settings.toml", "base.json"))
    arm.write_bytes(built("arm"))
    settings.write_bytes(MARK + b"[check]\n")
    call("check", arm, "--write-baseline", baseline).product()
    baseline.write_bytes(MARK + baseline.read_bytes())
    assert call("check", arm, "--config", settings, "--baseline", baseline).code == 0


@pytest.mark.parametrize("mark", [MARK, b"\xff\xfe", b"\xfe\xff"])
@pytest.mark.parametrize("command", ["convert", "inspect", "view"])
def test_in_a_gltf_it_is_named(command: str, mark: bytes, call: Call, tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    content = text(animated())
    encoded = content if mark == MARK else content.decode().encode("utf-16-le" if mark[0] == 0xFF else "utf-16-be")
    path.write_bytes(mark + encoded)
    out = [tmp_path / "out.glb"] if command == "convert" else []
    run = call(command, path, *out, *(["-o", tmp_path / "out.html"] if command == "view" else []))
    words = run.err if command == "inspect" else refusal(run, 3)
    assert f"{path}: {NAMED}" in words
    assert "without BOM" in help_line(run)


def test_what_follows_it_is_inspected(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_bytes(MARK + text(animated()))
    run = call("inspect", path, "--format", "json")
    (file,) = json.loads(run.out)["files"]
    assert (run.code, file["error"], [clip["name"] for clip in file["clips"]]) == (3, NAMED, ["walk"])


def test_in_a_glb_it_is_named(call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(glb(MARK + text(animated())))
    assert NAMED in refusal(call("convert", tmp_path / "a.glb", tmp_path / "b.glb"), 3)
