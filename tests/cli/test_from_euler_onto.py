"""`from-euler --onto`: motion on a character, and what becomes of its own clips."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.curve_files import SMALL, valid
from tests.cli.running import built, help_line, refusal
from tests.clips import track
from tests.files import glb_of, opened, opened_fixture


def test_onto_a_character(call: Call, asset: Find, fixture: Fixture) -> None:
    run = call("from-euler", asset("bvh/cmu_01_01.bvh"), "-", "--onto", fixture("biped"), "-v")
    document = opened(run.product())
    valid(run.out)
    assert [clip.name for clip in reader.clips(document)] == ["walk", "wave", "jump", "cmu_01_01"]
    assert "onto: 21 of 31 joints matched; not: 'LHipJoint', 'RHipJoint'" in run.err
    assert "LeftUpLeg → left_upper_leg" in run.err


@pytest.mark.parametrize("axis", ["Z", "X"])
def test_a_character_that_lies_at_rest_is_warned_of(axis: str, call: Call, asset: Find) -> None:
    """The biped's nodes, without its skin, below a node that is turned by 90°."""
    document = opened_fixture("biped")
    nodes = [{key: each[key] for key in each if key not in ("mesh", "skin")} for each in document.json["nodes"]]
    turn = [0.5**0.5, 0, 0, 0.5**0.5] if axis == "Z" else [0, 0, 0.5**0.5, 0.5**0.5]
    nodes.append({"name": "armature", "rotation": turn, "children": document.json["scenes"][0]["nodes"]})
    rest = {key: each for key, each in document.json.items() if key not in ("skins", "meshes")}
    json = {**rest, "nodes": nodes, "scenes": [{"nodes": [len(nodes) - 1]}]}
    lying = glb_of(replace(document, json=json))
    run = call("from-euler", asset("bvh/cmu_01_01.bvh"), "-", "--onto", "-", stdin=lying)
    run.product()
    words = f"the motion's figure stands along Y, the character along {axis}: it will lie; is its file {axis}-up?"
    assert words in run.err
    standing = call("from-euler", asset("bvh/cmu_01_01.bvh"), "-", "--onto", "-", stdin=built("biped"))
    assert "it will lie" not in standing.err
    turned = call("from-euler", asset("bvh/cmu_01_01.bvh"), "-", "--up", "z", "--onto", "-", stdin=built("biped"))
    assert "it will lie" in turned.err


def test_without_legs_and_feet_the_path_is_by_height_and_nothing_is_floored(
    call: Call, asset: Find, tmp_path: Path
) -> None:
    """The recorded person is 1.47 m tall, the character's nodes 1.20 m."""
    text = asset("bvh/cmu_01_01.bvh").read_text()
    for name in ("Hips", "HipJoint", "UpLeg", "Leg", "Foot", "ToeBase", "LowerBack"):
        text = re.sub(rf"(ROOT|JOINT) (\w*){name}\b", r"\1 \2Unknown" + str(len(name)), text)
    (tmp_path / "upper.bvh").write_text(text)
    run = call("from-euler", tmp_path / "upper.bvh", "-", "--onto", asset("BitmojiRun.glb"))
    run.product()
    assert "legs, feet; the path is scaled by the sizes of both figures" in run.err
    assert "for the floor" not in run.err
    assert float(run.err.split("onto: path × ")[1].split()[0]) == pytest.approx(1.20 / 1.47, abs=0.01)


def test_a_name_that_is_taken_gets_a_number(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    (tmp_path / "walk.bvh").write_bytes(SMALL)
    (tmp_path / "names.csv").write_text("hip,hips\n")
    onto = (tmp_path / "walk.bvh", "-", "--onto", fixture("biped"), "--alias", tmp_path / "names.csv")
    run = call("from-euler", *onto)
    assert [clip.name for clip in reader.clips(opened(run.product()))] == ["walk", "wave", "jump", "walk 2"]
    assert "warning: the character has a clip 'walk': this one is called 'walk 2'" in run.err
    told = call("from-euler", *onto, "--name", "walk")
    assert [clip.name for clip in reader.clips(opened(told.product()))] == ["walk", "wave", "jump", "walk"]
    assert "warning: a second clip 'walk': #3 beside #0, which players and diff find first (--replace '#0'" in told.err


def test_a_clip_gives_way(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    (tmp_path / "walk.bvh").write_bytes(SMALL)
    (tmp_path / "names.csv").write_text("hip,hips\n")
    onto = (tmp_path / "walk.bvh", "-", "--onto", fixture("biped"), "--alias", tmp_path / "names.csv")
    by_name = call("from-euler", *onto, "--replace", "wave")
    document = opened(by_name.product())
    assert [clip.name for clip in reader.clips(document)] == ["walk", "wave", "jump"]
    assert reader.clips(document)[1].end == pytest.approx(1 / 30)
    assert "the character has a clip" not in by_name.err
    assert call("from-euler", *onto, "--replace", "#1").out == by_name.out
    assert call("from-euler", *onto, "--replace", "w*").code == 5
    missing = call("from-euler", *onto, "--replace", "wavy")
    assert (missing.code, "did you mean 'wave'?" in missing.err) == (5, True)
    for same in ("wave", "#1"):
        assert call("from-euler", *onto, "--replace", same, "--name", "wave").product() == by_name.out
    other = call("from-euler", *onto, "--replace", "#1", "--name", "hello")
    assert "--replace keeps the name of the clip, 'wave' (got --name 'hello')" in refusal(other, 2)
    assert help_line(other) == "leave --name out"


def test_what_a_bvh_does_not_hold_stays_when_the_clip_gives_way(call: Call, asset: Find, tmp_path: Path) -> None:
    character = asset("BitmojiRun.glb")
    call("to-euler", character, tmp_path / "run.bvh")
    run = call("from-euler", tmp_path / "run.bvh", "-", "--onto", character, "--replace", "#0")
    before, after = (reader.clips(opened(data))[0] for data in (character.read_bytes(), run.product()))
    now = {(track.node, track.path) for track in after.tracks}
    moved = {(t.node, t.path) for t in before.tracks if np.ptp(t.values, axis=0).max() > 1e-4 and t.path != "scale"}
    assert moved <= now
    assert ErrorMetric(reader.scene(opened(run.product()))).error(before, after).max_error < 1e-4
    assert "tracks of 'lbr_run_normal_anm_default' that the motion has no node for stay" in run.err
    other = call("from-euler", asset("bvh/cmu_01_01.bvh"), "-", "--onto", character, "--replace", "#0")
    assert "that the motion has no node for go with it" in other.err


def test_a_scale_that_a_bvh_does_not_hold_is_named_when_its_clip_gives_way(call: Call, tmp_path: Path) -> None:
    content = json.loads(json.dumps(opened_fixture("biped").json))
    content["nodes"].append({"name": "armature", "children": [0]})
    armature = content["scenes"][0]["nodes"][0] = len(content["nodes"]) - 1
    document = replace(opened_fixture("biped"), json=content)
    walk = reader.clips(document)[0]
    for largest, named in ((2.0, True), (1.0, False)):
        scale = track("scale", [0, 1], [[1.0] * 3, [largest] * 3], node=armature)
        character = tmp_path / "scaled.glb"
        character.write_bytes(glb_of(writer.replace_clips(document, {0: Clip("walk", (*walk.tracks, scale))})))
        call("to-euler", character, tmp_path / "walk.bvh", "--clip", "walk")
        onto = ("--onto", character, "--replace", "walk", "--scale", ".01", "-q")
        run = call("from-euler", tmp_path / "walk.bvh", "-", *onto)
        run.product()
        assert ("warning: the motion lacks the scale of node 22 'armature' in 'walk'" in run.err) == named


def test_strangers_are_shown_how_to_pair(call: Call, asset: Find) -> None:
    run = call("from-euler", asset("bvh/example.bvh"), "-", "--onto", asset("CesiumMan.glb"))
    assert "no joint of the motion is one of the character" in refusal(run, 5)
    assert help_line(run) == "pair them in an --alias file, in lines such as 'Hips,Skeleton_torso_joint_1'"


def test_strangers_are_listed_where_all_is_to_be_said(call: Call, asset: Find) -> None:
    to = ("from-euler", asset("bvh/example.bvh"), "-", "--onto", asset("CesiumMan.glb"))
    run = call(*to, "-v")
    assert (run.code, run.out) == (5, b"")
    *lists, problem, help = run.err.splitlines()
    assert "no joint of the motion is one of the character" in problem
    assert help.startswith("help: pair them")
    joints, others = (line.split(": ", 1) for line in lists[-2:])
    assert joints[0] == "joints of the motion (18)"
    assert joints[1].split(", ")[:3] == ["'Hips'", "'Chest'", "'Neck'"]
    assert others[0] == "joints of the character (19)"
    assert others[1].split(", ")[0] == "'Skeleton_torso_joint_1'"
    assert len(others[1].split(", ")) == 19
    assert "joints of the character" not in call(*to).err


def test_too_many_strangers_fail(call: Call, asset: Find, fixture: Fixture) -> None:
    source, character = asset("bvh/cmu_01_01.bvh"), fixture("biped")
    run = call("from-euler", source, "-", "--onto", character, "--fail-unmatched", "9")
    assert "10 joints could not be matched (limit 9)" in refusal(run, 6)
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
