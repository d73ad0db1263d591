"""`to-euler`: a clip as BVH, CSV or JSON curves."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.exchange.formats import bvh_reader
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import help_line, refusal
from tests.clips import CUBICSPLINE, about, clip, track
from tests.files import clips_of, glb_of, opened, opened_fixture


@pytest.mark.parametrize("suffix", ["bvh", "csv", "json"])
def test_the_ending_says_the_format(suffix: str, call: Call, fixture: Fixture, tmp_path: Path) -> None:
    path = tmp_path / f"walk.{suffix}"
    run = call("to-euler", fixture("biped"), path, "--clip", "walk")
    assert run.code == 0, run.err
    assert run.out == b""
    start = {
        "bvh": "HIERARCHY\nROOT hips",
        "csv": "# order=ZXY frame=intrinsic unit=deg\n#node,hips",
        "json": '{\n "schema"',
    }
    assert path.read_text().startswith(start[suffix])
    assert call("from-euler", path, tmp_path / "back.glb").code == 0


@pytest.mark.parametrize("options", [(), ("--scale", "0.0254")])
def test_a_bvh_is_read_back_with_the_scale_that_it_names(
    options: tuple[str, ...], call: Call, fixture: Fixture, tmp_path: Path
) -> None:
    path, back = tmp_path / "walk.bvh", tmp_path / "back.glb"
    run = call("to-euler", fixture("biped"), path, "--clip", "walk", "--fps", "24", *options)
    said = re.search(r"1 unit = \S+ m \(from-euler (--scale) (\S+)\), ", run.err)
    assert said is not None
    assert call("from-euler", path, back, *said.groups()).code == 0
    (hips,) = (track for track in clips_of(back.read_bytes())[0].tracks if track.path == "translation")
    assert hips.values[0, 1] == pytest.approx(0.93, abs=0.1)
    assert "1 unit" not in call("to-euler", fixture("biped"), tmp_path / "walk.csv", "--clip", "walk").err


def test_bvh_on_stdout(call: Call, fixture: Fixture) -> None:
    run = call("to-euler", fixture("biped"), "--clip", "walk", "--fps", "24", "--order", "YXZ", "--scale", "1")
    motion = bvh_reader.read(run.product())
    assert [node.name for node in motion.nodes][:2] == ["hips", "spine"]
    assert {node.order for node in motion.nodes if not node.end} == {"YXZ"}
    assert motion.nodes[0].moves[1].values[0] == pytest.approx(0.93, abs=0.1)


def test_each_joint_can_have_its_order(call: Call, fixture: Fixture) -> None:
    walk = (fixture("biped"), "--clip", "walk", "--fps", "24")
    motion = bvh_reader.read(call("to-euler", *walk, "--order", "hips=xzy,*leg=zyx,yxz").product())
    orders = {node.name: node.order for node in motion.nodes}
    assert [orders[name] for name in ("hips", "left_lower_leg", "head")] == ["XZY", "ZYX", "YXZ"]
    auto = json.loads(call("to-euler", *walk, "--order", "auto", "--format", "json").product())
    assert len({node.get("order", auto["order"]) for node in auto["nodes"]}) > 1
    run = call("to-euler", *walk, "--order", "hip=XYZ")
    assert "order 'hip=XYZ', but no node is called that" in refusal(run, 5)
    assert help_line(run) == "did you mean 'hips'?"


def test_a_tolerance_adds_keys(call: Call, fixture: Fixture) -> None:
    plain, fine = (
        json.loads(call("to-euler", fixture("biped"), "--clip", "wave", "--format", "json", *more).product())
        for more in ((), ("--angle-tolerance", "0.01deg"))
    )
    count = [sum(len(c["times"]) for n in f["nodes"] for c in n.get("curves", {}).values()) for f in (plain, fine)]
    assert count[1] > count[0]
    assert all(node["name"] != "body" for node in plain["nodes"])


def test_splines_that_angles_do_not_follow_are_warned_of(call: Call, tmp_path: Path) -> None:
    """Three keys, 0°, 115° and 0°, with tangents: linear angles between them are far off."""
    document = opened_fixture("arm")
    joint = next(t.node for t in reader.clips(document)[0].tracks if t.path == "rotation")
    turn, out = about("z", [0, 115, 0]), np.array([[0, 0, 1.5, 0], [0, 0, 0, 0], [0, 0, -1.5, 0]])
    swing = clip(track("rotation", [0, 1, 2], turn, CUBICSPLINE, tangents=(out, out), node=joint), name="twist")
    path = tmp_path / "swing.glb"
    path.write_bytes(glb_of(writer.replace_clips(document, {0: swing})))
    for out_file in ("a.csv", "a.json"):
        run = call("to-euler", path, tmp_path / out_file, "--clip", "twist", "-q")
        assert run.err.startswith("warning: between keys, the curves are off by up to ")
        assert run.err.endswith("°: --angle-tolerance 0.1deg adds keys\n")
        mended = call("to-euler", path, tmp_path / out_file, "--clip", "twist", "--angle-tolerance", "0.1deg")
        assert "warning" not in mended.err
    assert "warning" not in call("to-euler", path, tmp_path / "bend.csv", "--clip", "bend").err


def test_the_clip_must_be_one(call: Call, fixture: Fixture) -> None:
    run = call("to-euler", fixture("biped"), "-")
    assert "3 clips to choose from (expected one)" in refusal(run, 5)
    assert help_line(run) == "--clip one of 'walk', 'wave', 'jump'"


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("--axes", "extrinsic"), "a BVH's angles are intrinsic"),
        (("--unit", "rad"), "a BVH's angles are intrinsic"),
        (("--angle-tolerance", "1deg"), "--angle-tolerance adds keys"),
        (("--scale", "-1"), "--scale is -1"),
        (("--scale", "1e-13"), "--scale is 1e-13 (expected 1e-12 to 1e+15)"),
        (("--scale", "1", "--format", "csv"), "--scale is the unit of a BVH"),
        (("--fps", "0"), "fps is 0"),
        (("--format", "fbx"), "to-euler"),
        (("--order", "XXY"), "--order is 'XXY'"),
        (("--order", "auto", "--format", "csv"), "a CSV has one order"),
    ],
)
def test_refusals(call: Call, fixture: Fixture, args: tuple[str, ...], words: str) -> None:
    run = call("to-euler", fixture("biped"), "-", "--clip", "walk", *args)
    assert words in refusal(run, 2)


def test_an_unknown_ending_is_refused(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("to-euler", fixture("biped"), tmp_path / "walk.fbx", "--clip", "walk")
    assert "names no format (expected .bvh, .json, .csv, or --format)" in refusal(run, 2)


def test_dry_run_writes_nothing(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("to-euler", fixture("biped"), tmp_path / "walk.bvh", "--clip", "walk", "--dry-run")
    assert run.code == 0
    assert "nothing written" in run.err
    assert not (tmp_path / "walk.bvh").exists()


def test_real_characters(call: Call, asset: Find) -> None:
    run = call("to-euler", asset("Fox.glb"), "-", "--clip", "Run", "--fps", "24")
    assert len(bvh_reader.read(run.product()).nodes) >= 24


@pytest.mark.parametrize("kind", ["bvh", "json"])
def test_the_bind_pose_is_said_to_be_the_rest(kind: str, call: Call, biped: bytes) -> None:
    """Even where quiet: it changes what angles and rests in the file mean."""
    document = opened(biped)
    nodes = [dict(node) for node in document.json["nodes"]]
    arm = next(node for node in nodes if node["name"] == "left_upper_arm")
    args = ("to-euler", "-", "-", "--clip", "walk", "--fps", "24", "--format", kind, "--quiet")
    assert call(*args, stdin=biped).err == ""
    arm["rotation"] = [0, 0, 0.6, 0.8]
    run = call(*args, stdin=glb_of(replace(document, json={**document.json, "nodes": nodes})))
    assert run.product()
    assert "3 joints rest elsewhere in the file than the skin was bound: the bind pose is the rest" in run.err


@pytest.mark.parametrize("suffix", ["csv", "json"])
def test_a_file_without_nodes_is_written_without_any(suffix: str, call: Call, tmp_path: Path) -> None:
    clip_of_none = {"name": "a", "channels": [], "samplers": []}
    (tmp_path / "in.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "animations": [clip_of_none]}))
    call("to-euler", tmp_path / "in.gltf", tmp_path / f"out.{suffix}").product()
    assert (tmp_path / f"out.{suffix}").stat().st_size


def test_scales_that_only_repeat_the_rest_pose_are_not_missed(asset: Find, call: Call, tmp_path: Path) -> None:
    """Within 1e-6, in files of exporters that write them for every node."""
    run = call("to-euler", asset("CesiumMan.glb"), tmp_path / "out.bvh")
    assert run.code == 0
    assert "left out" not in run.err
