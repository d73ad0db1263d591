"""`collapse`: a table to read, one JSON document, a picture; and advice."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Call, Fixture
from tests.cli.running import refusal, shell


def test_a_table_with_advice(call: Call, fixture: Fixture) -> None:
    run = call("collapse", fixture("tube"))
    assert run.code == 0
    assert run.err == ""
    lines = run.text.splitlines()
    assert lines[0].endswith("tube.glb: 3 clips, 1 skinned mesh")
    header = lines[2].split("  ")
    assert header[1].strip() == "clip"
    assert "volume lbs" in lines[2]
    rows = {line.split()[0]: line for line in lines[3:6]}
    assert "0.71" in rows["twist90"]
    assert "67 %" in rows["twist90"]
    assert "90° twist" in rows["twist90"]
    assert "180° twist" in rows["twist180"]
    assert "33 %" in rows["twist180"]
    assert "90° bend" in rows["bend90"]
    assert "  1 clip pinches; worst 0.00 in 'twist180'" in run.text
    assert "--method dqs" in run.text


def test_one_json_document(call: Call, fixture: Fixture) -> None:
    report = call("collapse", fixture("tube"), "--format", "json", "--method", "cor", "--clip", "twist90").json
    assert report["schema"] == 1
    assert report["methods"] == ["cor"]
    (clip,) = report["clips"]
    (mesh,) = clip["meshes"]
    assert clip["clip"] == "twist90"
    assert mesh["index"] == pytest.approx(0.5**0.5, abs=1e-6)
    assert mesh["angle_deg"] == pytest.approx(90, abs=1e-3)
    assert (mesh["joint"], mesh["other_joint"], mesh["twist"], mesh["time_s"]) == ("lower", "upper", True, 1.0)
    (method,) = mesh["methods"]
    assert method["volume_min"] == pytest.approx(1, abs=1e-3)
    assert method["bulge_max"] == pytest.approx(1, abs=1e-4)
    assert report["advice"][0].startswith("linear blending is good enough")


@pytest.mark.parametrize(("ending", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_a_picture(ending: str, start: bytes, call: Call, fixture: Fixture, tmp_path: Path) -> None:
    out = tmp_path / f"tube.{ending}"
    run = call("collapse", fixture("tube"), "--plot", out)
    assert run.code == 0
    assert run.err.startswith(f"{out}  ")
    once = out.read_bytes()
    assert once.startswith(start)
    assert call("collapse", tmp_path / "tube.glb", "--plot", out).code == 0
    assert out.read_bytes() == once


def test_every_mesh_on_request(call: Call, asset: object) -> None:
    path = asset("Knight.glb")  # type: ignore[operator]
    short = call("collapse", path, "--clip", "Throw", "--fps", "10").text
    long = call("collapse", path, "--clip", "Throw", "--fps", "10", "-v").text
    assert "the worst mesh of each clip (-v: all)" in short
    assert len(long.splitlines()) == len(short.splitlines()) + 5
    only = call("collapse", path, "--clip", "Throw", "--fps", "10", "--mesh", "Cube.126").text
    assert ": 1 clip, 1 skinned mesh\n" in only


def test_pipes(fixture: Fixture, tmp_path: Path) -> None:
    fixture("arm")
    run = shell("cat arm.glb | gltf-anim collapse --clip bend", tmp_path)
    assert run.text.startswith("stdin: 1 clip, 1 skinned mesh\n")


def test_refusals(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    source = fixture("arm")
    assert "--fps is 0 (expected a number above 0)" in refusal(call("collapse", source, "--fps", "0"), 2)
    assert "is no .png or .svg file" in refusal(call("collapse", source, "--plot", tmp_path / "a.gif"), 2)
    assert "no mesh matches 'x'" in refusal(call("collapse", source, "--mesh", "x"), 5)
    assert "no skinned mesh" in refusal(call("collapse", fixture("morph_cube")), 5)
