"""`gltf-anim loop`: its report, and the loops that it closes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.maths import quaternion
from anim.model import Clip
from anim.sampling.track import sample
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import built, help_line, refusal
from tests.clips import LINEAR, about, track
from tests.files import clips_of, glb_of, opened


def test_report_names_the_kind(call: Call, fixture: Fixture) -> None:
    run = call("loop", fixture("biped"), "--clip", "walk")
    assert "closed" in run.text
    assert run.err == ""


def test_json_has_units_in_its_keys(call: Call, fixture: Fixture) -> None:
    report = call("loop", fixture("biped"), "--format", "json").json
    assert report["schema"] == 1
    assert {"clip", "kind", "start_s", "end_s", "seam_m", "speed_seam_m_per_s", "travel_m"} <= report["loops"][0].keys()


@pytest.mark.parametrize("options", [(), ("--find",)])
def test_a_file_without_clips_is_called_so(options: tuple[str, ...], call: Call, fixture: Fixture) -> None:
    assert call("loop", fixture("wall"), *options).text == "  no clips\n"


def test_a_file_without_a_vertex_is_measured_at_nodes(call: Call, fixture: Fixture) -> None:
    document = opened(fixture("biped").read_bytes())
    nodes = [
        {key: value for key, value in node.items() if key not in ("mesh", "skin")} for node in document.json["nodes"]
    ]
    bare = {key: value for key, value in document.json.items() if key != "meshes"}
    data = glb_of(replace(document, json={**bare, "nodes": nodes}))
    assert call("loop", "--format", "json", stdin=data).json["measured_on"] == "nodes"
    assert "loop gap (nodes)" in call("loop", stdin=data).text
    assert call("loop", fixture("biped"), "--format", "json").json["measured_on"] == "skin"
    assert "loop gap (nodes)" not in call("loop", fixture("biped")).text


def test_find_proposes_ranges(call: Call, fixture: Fixture) -> None:
    found = call("loop", fixture("biped"), "--clip", "walk", "--find", "--format", "json").json["loops"]
    assert found[0]["seam_m"] < 1e-4
    assert found[0]["end_s"] - found[0]["start_s"] >= 0.5


@pytest.mark.parametrize(
    ("clip", "options", "words"),
    [
        ("walk", (), "clip 'walk': no time range loops better than the whole clip"),
        ("walk", ("--shortest", "50"), "clip 'walk': no time range is as long as --shortest"),
        ("walk", ("--shortest", "1e300"), "clip 'walk': no time range is as long as --shortest"),
        ("fall", (), "clip 'fall': no time range loops"),
        ("pose", (), "clip 'pose': a single pose, without a range to find"),
        ("nods", (), ""),
    ],
)
def test_find_says_where_no_part_is_better(clip: str, options: tuple[str, ...], words: str, call: Call) -> None:
    turns = {"fall": (0.0, 10, 40, 90, 160), "pose": (5.0,), "nods": (0.0, 60, 0, -30, 0, 90)}
    data = built("biped")
    if clip in turns:
        rotation = track("rotation", 0.5 * np.arange(len(turns[clip])), about("x", turns[clip]), LINEAR, node=0)
        document = opened(data)
        data = glb_of(writer.replace_clips(document, {0: Clip("walk", (rotation,))}))
        data = data.replace(b'"walk"', b'"%s"' % clip.encode())
    run = call("loop", "--find", "--clip", clip, *options, stdin=data)
    assert run.code == 0, run.err
    assert run.text.endswith(f"  {words}\n") if words else "no time range" not in run.text
    notes = call("loop", "--find", "--clip", clip, *options, "--format", "json", stdin=data).json["notes"]
    assert notes == ([words] if words else [])


def test_an_open_loop_gets_its_missing_frame(call: Call, fixture: Fixture) -> None:
    cut = call("trim", fixture("biped"), "--clip", "walk", "--to", "0.9583333", "-q").product()
    assert call("loop", "--clip", "walk", "--format", "json", stdin=cut).json["loops"][0]["kind"] == "open by one frame"
    closed = call("loop", "-", "-", "--clip", "walk", "-q", stdin=cut).product()
    found = call("loop", "--clip", "walk", "--format", "json", stdin=closed).json["loops"][0]
    assert found["kind"] == "closed"
    assert found["end_s"] == pytest.approx(1.0, abs=1e-5)


def _walking_on(*, flies_back: bool = False) -> bytes:
    """The biped's walk, whose hips travel at 2 m/s; or fly back to their start in the last frame."""
    document = opened(built("biped"))
    number = next(i for i, clip in enumerate(reader.clips(document)) if clip.name == "walk")
    clip = reader.clips(document)[number]
    times = np.arange(25) / 24
    tracks = []
    for each in clip.tracks:
        if each.path == "translation":
            values = sample(each, times) + np.array([0, 0, 2.0]) * times[:, None]
            values[-1] = values[0 if flies_back else -1]
            each = track(each.path, times, values, LINEAR, node=each.node)
        tracks.append(each)
    return glb_of(writer.replace_clips(document, {number: Clip(clip.name, tuple(tracks))}))


def test_a_traveling_figure_walks_on_in_the_frame_that_was_missing(call: Call) -> None:
    """Its root flew back to the start."""
    cut = call("trim", "--clip", "walk", "--to", "0.9583333", "-q", stdin=_walking_on()).product()
    for options in ((), ("--blend", "0.2")):
        closed = call("loop", "-", "-", "--clip", "walk", *options, "-q", stdin=cut).product()
        clip = next(each for each in clips_of(closed) if each.name == "walk")
        root = next(each for each in clip.tracks if each.path == "translation")
        start, half, end = sample(root, np.array([0, 23.5 / 24, 1.0]))[:, 2]
        assert half - start == pytest.approx(2 * 23.5 / 24, abs=0.01)
        assert end - start == pytest.approx(2, abs=0.01)
        found = call("loop", "--clip", "walk", "--format", "json", stdin=closed).json
        assert found["loops"][0]["travel_m"] == pytest.approx(2, abs=0.01)
        assert found["advice"] == []


def test_a_velocity_gap_alone_is_named(call: Call) -> None:
    """A root that flies back in the last frame closes in pose, at 46 m/s; only a column of the table showed it."""
    back = _walking_on(flies_back=True)
    report = call("loop", "--clip", "walk", "--format", "json", stdin=back).json
    assert report["loops"][0]["kind"] == "closed"
    assert "to close a velocity gap" in report["advice"][0]
    assert "to close a velocity gap" in call("loop", "--clip", "walk", stdin=back).text


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_what_is_closed_keeps_its_bytes(ending: str, call: Call, walk: Path, tmp_path: Path) -> None:
    """Also in a style that we don't write."""
    path = tmp_path / f"style.{ending}"
    call("convert", walk, path).product()
    if ending == "gltf":
        path.write_text(json.dumps(json.loads(path.read_text()), indent=5))
    else:
        data = path.read_bytes()
        size = int.from_bytes(data[12:16], "little")
        text = json.dumps(json.loads(data[20 : 20 + size]), indent=3).encode()
        text += b" " * (-len(text) % 4)
        total = len(data) - size + len(text)
        head = b"glTF" + (2).to_bytes(4, "little") + total.to_bytes(4, "little") + len(text).to_bytes(4, "little")
        path.write_bytes(head + data[16:20] + text + data[20 + size :])
    before = {each: each.read_bytes() for each in tmp_path.iterdir()}
    run = call("loop", path, path, "--clip", "walk")
    assert run.code == 0
    assert "unchanged: no track was changed" in run.err
    assert {each: each.read_bytes() for each in tmp_path.iterdir()} == before
    if ending == "glb":
        assert call("loop", "-", "-", "--clip", "walk", "-q", stdin=before[path]).product() == before[path]


def test_no_loop_needs_a_blend(call: Call, fixture: Fixture) -> None:
    half = call("trim", fixture("biped"), "--clip", "walk", "--to", "0.5", "-q").product()
    run = call("loop", "-", "-", "--clip", "walk", stdin=half)
    assert "is not a loop" in refusal(run, 2)
    assert "--blend" in help_line(run)
    closed = call("loop", "-", "--clip", "walk", "--blend", "0.2", "-q", stdin=half).product()
    assert call("loop", "--clip", "walk", "--format", "json", stdin=closed).json["loops"][0]["kind"] == "closed"


def test_all_that_cannot_be_closed_is_named_and_nothing_is_written(call: Call, asset: Find, tmp_path: Path) -> None:
    path = asset("Knight.glb")
    run = call("loop", path, tmp_path / "out.glb", "--clip", "Death_B", "--clip", "T-Pose", "--clip", "Death_A")
    said = refusal(run, 2)
    assert "Knight.glb: clip" in said
    assert "'Death_B' is not a loop" in said
    assert "'Death_A' is not a loop" in said
    assert "T-Pose" not in said
    assert not (tmp_path / "out.glb").exists()


def test_a_single_pose_is_called_so(call: Call, asset: Find, tmp_path: Path) -> None:
    path = asset("Knight.glb")
    found = call("loop", path, "--clip", "T-Pose", "--format", "json").json["loops"][0]
    assert found["kind"] == "a single pose"
    run = call("loop", path, tmp_path / "out.glb", "--clip", "T-Pose", "--blend", "0.1")
    assert run.code == 0
    assert "a single pose, without a loop to close: clip 'T-Pose'" in run.err


def _limping(walk: Path) -> bytes:
    """The biped's walk, whose left leg drifts away by 4° until the end: as a .glb."""
    document = opened(walk.read_bytes())
    number = next(i for i, clip in enumerate(reader.clips(document)) if clip.name == "walk")
    clip, names = reader.clips(document)[number], reader.skeleton(document).names
    tracks = []
    for each in clip.tracks:
        if each.path == "rotation" and each.node is not None and names[each.node] == "left_upper_leg":
            drift = about("x", np.linspace(0, 4, len(each.times)))
            each = replace(each, values=quaternion.multiply(each.values, drift))
        tracks.append(each)
    return glb_of(writer.replace_clips(document, {number: Clip(clip.name, tuple(tracks))}))


def test_a_joint_that_stays_open_is_named_and_alone_is_bent(call: Call, walk: Path) -> None:
    limping = _limping(walk)
    (found,) = call("loop", "--clip", "walk", "--format", "json", stdin=limping).json["loops"]
    assert found["kind"] == "closed except some joints"
    assert [each["joint"] for each in found["open_joints"]] == ["left_upper_leg"]
    assert found["open_joints"][0]["gap_m"] == pytest.approx(found["seam_m"], rel=0.1)
    assert found["seam_m"] < found["largest_frame_motion_m"]
    assert "left_upper_leg" in call("loop", "--clip", "walk", stdin=limping).text
    run = call("loop", "-", "-", "--clip", "walk", stdin=limping)
    assert "is closed except at 'left_upper_leg'" in refusal(run, 2)
    assert "--blend" in help_line(run)
    closed = call("loop", "-", "--clip", "walk", "--blend", "0.3", "-q", stdin=limping).product()
    (now,) = call("loop", "--clip", "walk", "--format", "json", stdin=closed).json["loops"]
    assert (now["kind"], now["open_joints"]) == ("closed", [])
    before, after = (next(clip for clip in clips_of(data) if clip.name == "walk") for data in (limping, closed))
    assert after.end == before.end
    changed = [
        old.target
        for old, new in zip(before.tracks, after.tracks, strict=True)
        if not (np.array_equal(old.times, new.times) and np.array_equal(old.values, new.values))
    ]
    assert len(changed) == 1


@pytest.mark.parametrize("name", ["noop.glb", "CesiumMan.glb"])
def test_inspect_and_check_say_the_same(name: str, call: Call, asset: Find, fixture: Fixture) -> None:
    """They called a clip that lacks its last frame one to blend, by another length of time."""
    path = fixture("noop") if name == "noop.glb" else asset(name)
    report = call("loop", path, "--format", "json").json
    is_open = [each["kind"] == "open by one frame" for each in report["loops"]]
    assert any(is_open)
    inspected = call("inspect", path, "--format", "json").json["files"][0]
    assert [each["seam_m"] for each in inspected["clips"]] == pytest.approx(
        [each["seam_m"] for each in report["loops"]]
    )
    (found,) = [each for each in inspected["findings"] if each["name"] in ("loop-seam", "end-frame")]
    assert found["problem"].startswith("open by one frame: a loop jumps by ")
    assert found["advice"] in report["advice"]
    checked = call("check", path, "--format", "json").json["findings"]
    (alone,) = [each for each in checked if each["name"] in ("loop-seam", "end-frame")]
    assert (alone["problem"], alone["advice"]) == (found["problem"], found["advice"])


def test_a_gap_to_blend_has_the_same_advice_in_inspect(call: Call, walk: Path) -> None:
    """Over the same length of time."""
    limping = _limping(walk)
    (advice,) = call("loop", "--clip", "walk", "--format", "json", stdin=limping).json["advice"]
    findings = call("inspect", "--clip", "walk", "--format", "json", stdin=limping).json["files"][0]["findings"]
    (found,) = [each for each in findings if each["name"] == "loop-seam"]
    assert found["advice"].removeprefix("if it is to loop: ") == advice.split(": ", 1)[1]


@pytest.mark.slow
def test_verdicts_on_real_clips(call: Call, asset: Find) -> None:
    """As an artist calls them."""
    kinds = {}
    for name in ("Knight", "Robot", "Fox", "CesiumMan", "BitmojiRun"):
        for each in call("loop", asset(f"{name}.glb"), "--format", "json").json["loops"]:
            clip = "" if name == "CesiumMan" else each["clip"]  # its only clip has no name
            kinds[name, clip] = each["kind"], [one["joint"] for one in each["open_joints"]]
    kept = {key: value for key, value in kinds.items() if value[0] not in ("closed", "not a loop", "a single pose")}
    assert {key: kind for key, (kind, _) in kept.items()} == {
        ("Knight", "Walking_C"): "closed except some joints",
        ("Robot", "Robot_Dance"): "closed except some joints",
        ("CesiumMan", ""): "open by one frame",
    }
    assert kept["Knight", "Walking_C"][1] == ["upperleg.r", "lowerleg.r", "foot.r"]
    assert kept["Robot", "Robot_Dance"][1] == ["Head"]
    names = ("Idle", "Running_A", "Walking_A", "Cheer", "Jump_Full_Short")
    assert {kinds["Knight", name][0] for name in names} == {"closed"}
    names = ("Death_A", "Jump_Start", "Lie_Down", "Sit_Chair_Down", "Block")
    assert {kinds["Knight", name][0] for name in names} == {"not a loop"}


@pytest.mark.parametrize("shortest", ["-1", "-1e308"])
def test_the_shortest_range_has_a_length(shortest: str, call: Call, fixture: Fixture) -> None:
    run = call("loop", fixture("biped"), "--find", f"--shortest={shortest}")
    assert "--shortest is" in refusal(run, 2)


def test_a_list_of_clips_that_can_not_be_closed_is_not_cut(call: Call, asset: Find, tmp_path: Path) -> None:
    """It ended in the middle of a name."""
    said = refusal(call("loop", asset("Robot.glb"), tmp_path / "out.glb"), 2)
    assert said.count(" is ") >= 3
    assert "…" not in said
    assert said.rstrip().endswith("; and 1 clip more")
