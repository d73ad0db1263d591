"""`collapse`: a table to read, one JSON document, a picture; and advice."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pygltflib import GLTF2

from anim.gltf.reading import reader
from anim.skinning.analysis.collapse import collapse
from anim.skinning.analysis.recommendations import CollapseFinding
from cli.reports.collapse_report import CollapseReport, text
from tests.anim.show.reading import words
from tests.cli.conftest import Call, Fixture
from tests.cli.running import built, refusal, shell
from tests.clips import clip, track
from tests.files import mark_slow, opened_fixture


def test_a_table_with_advice(call: Call, fixture: Fixture) -> None:
    run = call("collapse", fixture("tube"))
    assert run.code == 0
    assert run.err == ""
    lines = run.text.splitlines()
    assert lines[0].endswith("tube.glb: 3 clips, 1 skinned mesh")
    header = lines[2].split("  ")
    assert header[1].strip() == "clip"
    assert "min volume lbs" in lines[2]
    rows = {line.split()[0]: line for line in lines[3:6]}
    assert "0.71" in rows["twist90"]
    assert "67 %" in rows["twist90"]
    assert "90° twist" in rows["twist90"]
    assert "180° twist" in rows["twist180"]
    assert "33 %" in rows["twist180"]
    assert "90° bend" in rows["bend90"]
    assert "  3 clips collapse; min index 0.00 in 'twist180'" in run.text
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
    assert report["advice"][0].startswith("no index is below 0.7")
    assert report["bulge_clamp"] is False
    assert report["skinned_meshes"] == 1


def test_a_quarter_twist_pinches_by_its_volume(call: Call, fixture: Fixture) -> None:
    """It loses a third of the volume, and its index of 0.71 is above 0.7."""
    report = call("collapse", fixture("tube"), "--format", "json", "--clip", "twist90").json
    (mesh,) = report["clips"][0]["meshes"]
    assert mesh["pinches"] is True
    assert mesh["index"] > report["low_index"]
    assert mesh["methods"][0]["volume_min"] == pytest.approx(2 / 3, abs=1e-3)
    assert report["low_volume"] == 0.9
    assert report["advice"][0].endswith("90° at 1.00 s; 67 % of the volume remains")


def test_advice_follows_what_was_measured(call: Call, fixture: Fixture, asset: object) -> None:
    man = call("collapse", asset("CesiumMan.glb"), "--method", "lbs", "--method", "dqs", "--method", "cor").text  # type: ignore[operator]
    assert "to bake with cor (" in man
    assert "dqs bulges" not in man
    assert man.endswith("--method cor --bulge-clamp --clip '#0'\n")
    arm = call("collapse", fixture("arm")).text
    assert "good enough" not in arm
    assert "1 clip collapses; min index 0.71 in 'twist'" in arm
    assert "bulges" not in arm


def test_the_clamp(call: Call, fixture: Fixture) -> None:
    free = call("collapse", fixture("tube"), "--clip", "bend90", "--format", "json").json
    run = call("collapse", fixture("tube"), "--clip", "bend90", "--bulge-clamp")
    assert run.text.splitlines()[0].endswith("tube.glb: 1 clip, 1 skinned mesh; dqs with --bulge-clamp")
    assert "gltf-anim bake IN OUT --method dqs --bulge-clamp --clip '#2'" in run.text
    held = call("collapse", fixture("tube"), "--clip", "bend90", "--bulge-clamp", "--format", "json").json
    assert held["bulge_clamp"] is True
    lbs, dqs = zip(*(each["clips"][0]["meshes"][0]["methods"] for each in (free, held)), strict=True)
    assert lbs[0] == lbs[1]
    assert dqs[1]["bulge_max"] < dqs[0]["bulge_max"] - 0.3


def test_without_clips_it_says_so(call: Call, tmp_path: Path) -> None:
    source = edited(tmp_path, lambda gltf: gltf.animations.clear())
    run = call("collapse", source)
    assert run.code == 0
    assert run.text.endswith("tube.glb: 0 clips, 1 skinned mesh\n\n  there is no clip to look at\n")
    report = call("collapse", source, "--format", "json").json
    assert (report["clips"], report["skinned_meshes"]) == ([], 1)
    assert report["advice"] == ["there is no clip to look at"]
    assert "there is no clip to draw" in refusal(call("collapse", source, "--plot", tmp_path / "a.png"), 5)
    assert not (tmp_path / "a.png").exists()


def test_clips_of_one_name_are_two(call: Call, tmp_path: Path) -> None:
    def named_alike(gltf: GLTF2) -> None:
        for each in gltf.animations:
            each.name = "turn"

    source = edited(tmp_path, named_alike)
    text = call("collapse", source).text
    assert "tube.glb: 3 clips, 1 skinned mesh\n" in text
    assert len([line for line in text.splitlines() if line.startswith("  turn ")]) == 3
    assert len(call("collapse", source, "--format", "json").json["clips"]) == 3


def edited(folder: Path, change: Callable[[GLTF2], object]) -> Path:
    """The tube in a folder, changed."""
    gltf = GLTF2.load_from_bytes(built("tube"))
    change(gltf)
    path = folder / "tube.glb"
    gltf.save(path)
    return path


PICTURES = [("png", b"\x89PNG"), ("svg", b"<?xml")]


@pytest.mark.parametrize(("ending", "start"), mark_slow(PICTURES, slow=PICTURES[1:]))
def test_a_picture(ending: str, start: bytes, call: Call, fixture: Fixture, tmp_path: Path) -> None:
    out = tmp_path / f"tube.{ending}"
    run = call("collapse", fixture("tube"), "--plot", out)
    assert run.code == 0
    assert run.err.startswith(f"{out}  ")
    once = out.read_bytes()
    assert once.startswith(start)
    assert call("collapse", tmp_path / "tube.glb", "--plot", out).code == 0
    assert out.read_bytes() == once


def test_clips_of_a_picture_have_one_scale(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    """A quarter turn leaves 67 % of the tube, a half turn 33 %: the lines of both are to be compared."""
    call("collapse", fixture("tube"), "--plot", tmp_path / "a.svg").product()
    said = words((tmp_path / "a.svg").read_bytes())
    assert said.count("tube  ·  least collapse index, lbs") == 3
    percents = {text for text in said if text.isdecimal() and int(text) > 1}
    assert len(percents) > 1
    assert min(map(int, percents)) <= 40
    assert {said.count(text) for text in percents} == {3}


def test_the_whole_is_100_percent() -> None:
    inside_out = clip(track("scale", [0], [[-1, 1, 1]]))
    (found,) = collapse(reader.scene(opened_fixture("tube")), inside_out, times=np.zeros(1))
    table = text(
        CollapseReport("tube.glb", 1, ("lbs", "dqs"), False, 30, [CollapseFinding(0, "mirrored", found)]), every=True
    )
    assert "  100 %     100 %  0.00 s" in table
    assert "e+" not in table


def test_every_mesh_on_request(call: Call, asset: object) -> None:
    path = asset("Knight.glb")  # type: ignore[operator]
    short = call("collapse", path, "--clip", "Throw", "--samples-per-second", "10").text
    long = call("collapse", path, "--clip", "Throw", "--samples-per-second", "10", "-v").text
    assert "the worst mesh of each clip (-v: all)" in short
    assert len(long.splitlines()) == len(short.splitlines()) + 5
    assert re.search(r"head\.001 +1\.00 .* s +head ", long), "one joint: no other, and no turn between them"
    only = call("collapse", path, "--clip", "Throw", "--samples-per-second", "10", "--mesh", "Cube.126").text
    assert ": 1 clip, 1 skinned mesh\n" in only


def test_pipes(fixture: Fixture, tmp_path: Path) -> None:
    fixture("arm")
    run = shell("cat arm.glb | gltf-anim collapse --clip bend", tmp_path)
    assert run.text.startswith("stdin: 1 clip, 1 skinned mesh\n")


def test_refusals(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    source = fixture("arm")
    assert "--samples-per-second is 0 (expected a number above 0)" in refusal(
        call("collapse", source, "--samples-per-second", "0"), 2
    )
    assert "is no .png or .svg file" in refusal(call("collapse", source, "--plot", tmp_path / "a.gif"), 2)
    assert "no mesh matches 'x'" in refusal(call("collapse", source, "--mesh", "x"), 5)
    clamp = call("collapse", source, "--method", "lbs", "--bulge-clamp")
    assert "--bulge-clamp requires a method other than lbs" in refusal(clamp, 2)
    assert "no skinned mesh" in refusal(call("collapse", fixture("morph_cube")), 5)
