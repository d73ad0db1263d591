"""`from-euler`: BVH, CSV and JSON become glTF that the Khronos validator takes, in pipes and files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from anim.exchange import bvh
from anim.gltf import read
from tests import khronos
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import Run, help_line, refusal, shell
from tests.files import opened, opened_path

SMALL = b"""HIERARCHY
ROOT hip
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT knee
  {
    OFFSET 0 -85 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -85 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.033333
0 90 0 0 0 0 0 0 0
1 90 0 0 0 90 0 90 0
"""
CURVES = b"time,door.rx,door.ry,door.rz\n0,0,0,0\n1,90,90,0\n"
XYZ = ("--order", "XYZ", "--frame", "intrinsic", "--unit", "deg")


def _valid(data: bytes) -> None:
    if not khronos.missing():
        report = khronos.validate(data)
        assert khronos.errors(report) == []
        assert report["issues"]["numWarnings"] == 0


@pytest.mark.parametrize("mesh", ["none", "sticks"])
def test_a_bvh_through_a_pipe(call: Call, mesh: str) -> None:
    run = call("from-euler", "-", "-", "--mesh", mesh, stdin=SMALL)
    document = opened(run.product())
    _valid(run.out)
    bones, clip = read.skeleton(document), read.clips(document)[0]
    assert bones.names[:3] == ("hip", "knee", "knee_end")
    assert clip.name == "motion"
    assert {(track.node, track.path) for track in clip.tracks} == {(0, "translation"), (0, "rotation"), (1, "rotation")}
    assert len(read.scene(document).instances) == (mesh == "sticks")
    assert document.json["asset"]["generator"].startswith("gltf-anim")


def test_it_says_what_it_guessed(call: Call) -> None:
    err = call("from-euler", "-", "-", stdin=SMALL).err
    assert "frame time 0.033333 s is taken for 1/30 s" in err
    assert "guessed: centimeters" in err
    assert "gimbal: 1 of 2 joints within 5° of lock; nearest 'knee'" in err
    assert call("from-euler", "-", "-", "-q", stdin=SMALL).err == ""


def test_scale_and_up(call: Call) -> None:
    document = opened(call("from-euler", "-", "-", "--scale", "0.5", "--up", "z", stdin=SMALL).product())
    np.testing.assert_allclose(read.skeleton(document).translation[1], (0, 0, 42.5), atol=1e-6)


def test_csv_keys_follow_the_motion(call: Call) -> None:
    run = call("from-euler", "-", "-", *XYZ, "--tolerance", "0.1deg", stdin=CURVES)
    _valid(run.out)
    assert 3 < len(read.clips(opened(run.product()))[0].tracks[0].times) <= 17


def test_a_gltf_with_its_bin(call: Call, tmp_path: Path) -> None:
    assert call("from-euler", "-", tmp_path / "door.gltf", *XYZ, "--name", "open", stdin=CURVES).code == 0
    assert read.clips(opened_path(tmp_path / "door.gltf"))[0].name == "open"


@pytest.mark.parametrize("name", ["cmu_01_01.bvh", "freebvh.bvh", "example.bvh"])
def test_real_files_are_valid(name: str, call: Call, asset: Find) -> None:
    run = call("from-euler", asset(f"bvh/{name}"), "-", "--mesh", "sticks")
    document = opened(run.product())
    _valid(run.out)
    assert read.clips(document)[0].name == name.removesuffix(".bvh")
    nodes = bvh.read(asset(f"bvh/{name}").read_bytes()).nodes
    assert len(document.json["skins"][0]["joints"]) == sum(not node.end for node in nodes)


def test_onto_a_character(call: Call, asset: Find, fixture: Fixture) -> None:
    run = call("from-euler", asset("bvh/cmu_01_01.bvh"), "-", "--onto", fixture("biped"), "-v")
    document = opened(run.product())
    _valid(run.out)
    assert [clip.name for clip in read.clips(document)] == ["walk", "wave", "jump", "cmu_01_01"]
    assert "onto: 21 of 31 joints matched; not: 'LHipJoint', 'RHipJoint'" in run.err
    assert "LeftUpLeg → left_upper_leg" in run.err


def test_too_many_strangers_fail(call: Call, asset: Find, fixture: Fixture) -> None:
    source, character = asset("bvh/cmu_01_01.bvh"), fixture("biped")
    run = call("from-euler", source, "-", "--onto", character, "--fail-unmatched", "9")
    assert "10 joints without a partner (limit 9)" in refusal(run, 6)
    assert call("from-euler", source, "-", "--onto", character, "--fail-unmatched", "10").code == 0


def test_aliases(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    (tmp_path / "names.csv").write_text("hip,hips\nknee,left_lower_leg\n")
    run = call("from-euler", "-", "-", "--onto", fixture("biped"), "--alias", tmp_path / "names.csv", stdin=SMALL)
    run.product()
    assert "onto: 2 of 2 joints matched" in run.err
    (tmp_path / "names.csv").write_text("hop,hips\n")
    run = call("from-euler", "-", "-", "--onto", fixture("biped"), "--alias", tmp_path / "names.csv", stdin=SMALL)
    assert "alias for 'hop'" in refusal(run, 5)
    assert help_line(run) == "did you mean 'hip'?"


def test_the_report_as_json(call: Call, tmp_path: Path) -> None:
    run = call("from-euler", "-", tmp_path / "a.glb", "--format", "json", stdin=SMALL)
    report = run.json
    assert (report["schema"], report["joints"], report["meters_per_unit"]) == (1, 2, 0.01)
    assert {"node", "nearest_deg", "near_s", "worst_condition", "best_order"} <= report["gimbal"][0].keys()
    assert (tmp_path / "a.glb").is_file()
    dry = call("from-euler", "-", "-", "--format", "json", "--dry-run", stdin=SMALL)
    assert dry.json["gimbal"] == report["gimbal"]


@pytest.mark.parametrize(
    ("args", "data", "code", "words"),
    [
        ((), SMALL.replace(b"90 0 90 0", b"90 0 nan 0"), 3, "stdin: line 20: number 8 is 'nan'"),
        ((), SMALL.replace(b"Frames: 2", b"Frames: 1000000000"), 3, "line 20: the file holds 2 of 1000000000"),
        ((), SMALL[:200], 3, "line "),
        ((), b"", 3, "stdin: is empty"),
        ((), b"\x89PNG\r\n", 3, "stdin: starts with"),
        (XYZ, SMALL, 2, "a BVH says the order of every joint itself"),
        ((), CURVES, 2, "nobody says the order"),
        (XYZ, CURVES.replace(b"1,90", b"1,9O"), 3, "stdin: line 3: door.rx is '9O'"),
        (XYZ, CURVES.replace(b"door.rz", b"door.rq"), 3, "stdin: line 1: "),
        (("--tolerance", "0"), SMALL, 2, "--tolerance is '0'"),
        (("--tolerance", "1mm"), SMALL, 2, "--tolerance is '1mm'"),
        (("--scale", "0"), SMALL, 2, "--scale is 0"),
        (("--format", "json"), SMALL, 2, "both want stdout"),
        (("--onto", "nobody.glb"), SMALL, 3, "nobody.glb: can't be read"),
        (("--order", "XXY"), SMALL, 2, "from-euler"),
    ],
)
def test_refusals(call: Call, args: tuple[str, ...], data: bytes, code: int, words: str) -> None:
    assert words in refusal(call("from-euler", "-", "-", *args, stdin=data), code)


def test_sticks_and_a_character_exclude_each_other(call: Call, fixture: Fixture) -> None:
    run = call("from-euler", "-", "-", "--onto", fixture("biped"), "--mesh", "sticks", stdin=SMALL)
    assert "--mesh makes a body" in refusal(run, 2)


def test_dry_run_writes_nothing(call: Call, tmp_path: Path) -> None:
    run = call("from-euler", "-", tmp_path / "a.glb", "--dry-run", stdin=SMALL)
    assert run.code == 0
    assert "nothing written" in run.err
    assert not list(tmp_path.iterdir())


def test_same_bytes_twice(call: Call) -> None:
    runs: list[Run] = [call("from-euler", "-", "-", "--mesh", "sticks", stdin=SMALL) for _ in range(2)]
    assert runs[0].product() == runs[1].product()


def test_in_a_shell_pipe(tmp_path: Path) -> None:
    (tmp_path / "small.bvh").write_bytes(SMALL)
    run = shell(
        "gltf-anim from-euler small.bvh | gltf-anim to-euler --order ZXY | gltf-anim from-euler -q | wc -c", tmp_path
    )
    assert run.code == 0, run.err
    assert int(run.text) > 500
