"""`inspect`: counts agree with a plain reader, every fault has its finding, and all three formats say the same."""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fixtures
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.playing import Player
from tests.cli.running import built, refusal, table
from tests.files import REAL
from tests.fixtures.reading import decode, split

Json = dict[str, Any]


@pytest.fixture(scope="module")
def noop() -> bytes:
    return built("noop")


def only(call: Call, data: bytes | Path, *options: str) -> Json:
    """The facts about one file."""
    run = call("inspect", "-", *options, "--format", "json", stdin=data) if isinstance(data, bytes) else None
    document = (run or call("inspect", str(data), *options, "--format", "json")).json
    assert document["schema"] == 1
    (facts,) = document["files"]
    found: Json = facts
    return found


def by_name(facts: Json) -> dict[str, Json]:
    return {clip["name"]: clip for clip in facts["clips"]}


def names_of_findings(facts: Json) -> set[str]:
    return {finding["name"] for finding in facts["findings"]}


@pytest.mark.parametrize("name", [name for name in fixtures.FIXTURES if not name.startswith("gltf")])
def test_counts_are_those_of_a_plain_reader(name: str, call: Call) -> None:
    data = built(name)
    player = Player(data)
    facts = only(call, data)
    assert facts["bytes"] == len(data)
    assert facts["nodes"] == len(player.nodes)
    assert [clip["name"] for clip in facts["clips"]] == player.names()
    for number, clip in enumerate(facts["clips"]):
        channels = player.channels(number)
        pointers = len(player.document["animations"][number]["channels"]) - len(channels)
        counted = Counter(channel.path for channel in channels)
        assert sum(clip["tracks"].values()) == len(channels) + pointers
        if not pointers:
            assert clip["tracks"] == counted
            assert clip["interpolations"] == Counter(channel.interpolation for channel in channels)
            assert clip["keys"] == sum(len(channel.times) for channel in channels)
            assert clip["start_s"] == min(channel.times[0] for channel in channels)
            assert clip["end_s"] == max(channel.times[-1] for channel in channels)
        assert clip["duration_s"] == clip["end_s"] - clip["start_s"]


def test_every_fault_of_a_clip_is_counted(noop: bytes, call: Call) -> None:
    clips = by_name(only(call, noop))
    still = ("constant_tracks", "no_effect_tracks", "redundant_keys")
    turning = ("non_unit_rotations", "sign_flips", "wide_steps")
    expected = {
        "constant": (1, 0, 24, 0, 0, 0),
        "at_rest": (3, 3, 3, 0, 0, 0),
        "straight": (0, 0, 23, 0, 0, 0),
        "signs": (0, 0, 23, 0, 24, 0),
        "non_unit": (0, 0, 1, 1, 0, 0),
        "half_turn": (0, 0, 0, 0, 0, 1),
        "open_loop": (0, 0, 0, 0, 0, 0),
        "one_key": (1, 0, 0, 0, 0, 0),
        "late": (0, 0, 0, 0, 0, 0),
    }
    assert {name: tuple(clip[key] for key in still + turning) for name, clip in clips.items()} == expected
    assert clips["straight"]["frame_rate_fps"] == 24
    assert clips["straight"]["frame_rate_regular"] == 1
    assert clips["half_turn"]["frame_rate_fps"] is None
    turn = 2 * math.acos(math.cos(math.radians(179 / 2)) * math.cos(math.radians(20 / 2)))  # 179° about y, 20° about z
    assert clips["half_turn"]["widest_step_rad"] == pytest.approx(turn, abs=1e-6)
    # From 0.25, 0.5, 0 to 1, 0.5, 0 in one second.
    assert (clips["late"]["root"], clips["late"]["root_distance_m"]) == ("cube", pytest.approx(0.75))
    assert clips["late"]["root_speed_m_per_s"] == pytest.approx(0.75)


def test_faults_are_findings_with_names_and_advice(noop: bytes, call: Call) -> None:
    findings = only(call, noop)["findings"]
    assert {finding["name"]: finding["severity"] for finding in findings} == {
        "non-unit-rotations": "warning",
        "wide-steps": "warning",
        "sign-flips": "info",
        "no-effect-tracks": "info",
        "constant-tracks": "info",
        "redundant-keys": "info",
        "late-start": "info",
    }
    assert all(finding[key] for finding in findings for key in ("where", "problem", "advice"))
    assert next(f["where"] for f in findings if f["name"] == "wide-steps") == "clip 'half_turn'"


def test_bytes_are_those_of_the_keys(noop: bytes, call: Call) -> None:
    facts = only(call, noop)
    clips = by_name(facts)
    assert clips["constant"]["data_bytes"] == 25 * (4 + 12)
    assert clips["signs"]["data_bytes"] == 25 * (4 + 16)
    # Nothing is shared here, but for the commas.
    assert facts["animation_data_bytes"] == sum(clip["data_bytes"] for clip in clips.values())
    document, _ = split(noop)
    least = len(json.dumps(document["animations"], separators=(",", ":")))
    assert least < facts["animation_json_bytes"] < len(noop) - facts["animation_data_bytes"]
    for clip in clips.values():
        assert clip["share"] == pytest.approx((clip["data_bytes"] + clip["json_bytes"]) / len(noop))


def test_a_skin_is_counted_vertex_by_vertex(call: Call) -> None:
    data = built("biped")
    document, blob = split(data)
    primitives = [primitive["attributes"] for primitive in document["meshes"][0]["primitives"]]
    weights = np.concatenate([decode(document, blob, attributes["WEIGHTS_0"]) for attributes in primitives])
    (skin,) = only(call, data)["skins"]
    assert skin["joints"] == 21
    assert skin["vertices"] == len(weights)
    assert skin["most_influences"] == (weights > 0).sum(axis=1).max()
    assert skin["mean_influences"] == pytest.approx((weights > 0).sum(axis=1).mean())
    assert (skin["unused_joints"], skin["off_sums"]) == (0, 0)
    assert skin["worst_sum_error"] == pytest.approx(np.abs(weights.sum(axis=1) - 1).max(), abs=1e-9)


def test_weights_that_do_not_sum_up_are_found(call: Call) -> None:
    data = built("arm")
    document, _ = split(data)
    view = document["bufferViews"][
        document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]]["bufferView"]
    ]
    spoiled = bytearray(data)
    start = len(data) - document["buffers"][0]["byteLength"] + view.get("byteOffset", 0)
    spoiled[start : start + 4] = np.float32(0.5).tobytes()
    facts = only(call, bytes(spoiled))
    assert facts["skins"][0]["off_sums"] == 1
    assert "weight-sums" in names_of_findings(facts)


def test_one_clip_may_be_chosen(noop: bytes, call: Call) -> None:
    facts = only(call, noop, "--clip", "late", "--clip", "one*")
    assert [clip["name"] for clip in facts["clips"]] == ["one_key", "late"]
    assert "wide-steps" not in names_of_findings(facts)


def test_tracks_are_listed_when_asked_for(call: Call) -> None:
    data = built("interpolations")
    assert "track_list" not in only(call, data)["clips"][0]
    listed = only(call, data, "--tracks")["clips"][0]["track_list"]
    assert [track["target"] for track in listed] == [
        f"{interpolation}_{path}"
        for interpolation in ("step", "linear", "cubicspline")
        for path in ("translation", "rotation", "scale")
    ]
    assert {track["keys"] for track in listed} == {4}
    assert listed[4]["widest_step_rad"] == pytest.approx(math.radians(80))


def test_csv_is_one_table_with_the_numbers_of_the_json(noop: bytes, call: Call, tmp_path: Path) -> None:
    for name in ("one.glb", "two.glb"):
        (tmp_path / name).write_bytes(noop)
    paths = [str(tmp_path / name) for name in ("one.glb", "two.glb")]
    files = call("inspect", *paths, "--format", "json").json["files"]
    rows = table(call("inspect", *paths, "--format", "csv").product())
    clips = [(facts["file"], clip) for facts in files for clip in facts["clips"]]
    assert len(rows) == len(clips) == 18
    for row, (file, clip) in zip(rows, clips, strict=True):
        assert row["file"] == file
        for key in ("name", "keys", "end_s", "seam_m", "frame_rate_fps", "share"):
            assert row[key] == ("" if clip[key] is None else str(clip[key]))
        assert int(row["rotation_tracks"]) == clip["tracks"].get("rotation", 0)
    tracks = table(call("inspect", *paths, "--format", "csv", "--tracks").product())
    assert len(tracks) == sum(sum(clip["tracks"].values()) for _, clip in clips)
    assert {row["constant"] for row in tracks} == {"true", "false"}


def test_the_text_names_what_matters(noop: bytes, call: Call) -> None:
    text = call("inspect", "-", stdin=noop).product().decode()
    assert text.startswith("stdin  8.73 kB: 1 node, 1 mesh, 36 vertices, 0 skins, 9 clips\n")
    for clip in by_name(only(call, noop)):
        assert clip in text
    for finding in only(call, noop)["findings"]:
        assert f"{finding['name']}: {finding['where']}: {finding['problem']}; {finding['advice']}" in text
    listed = call("inspect", "-", "--tracks", "--clip", "half_turn", stdin=noop).product().decode()
    assert "tracks of half_turn" in listed
    assert "179.0°" in listed


def test_a_sound_file_is_called_healthy(call: Call) -> None:
    assert "healthy" in call("inspect", "-", stdin=built("interpolations")).product().decode()


@pytest.mark.parametrize("name", ["gltf_external", "gltf_embedded"])
def test_text_files_count_with_their_buffers(name: str, fixture: Fixture, call: Call) -> None:
    path = fixture(name)
    sizes = {file: len(data) for file, data in fixtures.build_files(name).items()}
    facts = only(call, path)
    assert facts["file"] == str(path)
    assert facts["bytes"] == sum(sizes.values())
    assert [clip["name"] for clip in facts["clips"]] == ["slide"]


def test_a_buffer_or_image_that_is_not_there_is_a_finding(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "scene.gltf"
    content = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 4, "uri": "lost%20data.bin"}],
        "images": [{"uri": "there.png"}, {"uri": "lost.png"}, {"uri": "data:image/png;base64,AAAA"}],
    }
    path.write_text(json.dumps(content))
    (tmp_path / "there.png").touch()
    found = [(f["where"], f["problem"]) for f in only(call, path)["findings"] if f["name"] == "missing-file"]
    assert found == [
        ("buffer 0", "'lost data.bin' is not beside the file"),
        ("image 1", "'lost.png' is not beside the file"),
    ]
    assert "healthy" not in call("inspect", path).product().decode()


@pytest.mark.parametrize(
    ("name", "finding"),
    [
        ("draco", "vertices-unread"),
        ("unknown_required_extension", "unknown-extension"),
        ("joints_out_of_range", "vertices-unread"),
    ],
)
def test_what_does_not_concern_the_animation_is_a_finding(name: str, finding: str, call: Call) -> None:
    assert finding in names_of_findings(only(call, fixtures.BROKEN[name].data))


def test_of_several_files_a_bad_one_is_reported_and_the_others_go_on(noop: bytes, call: Call, tmp_path: Path) -> None:
    good, bad, lost = (str(tmp_path / name) for name in ("good.glb", "bad.glb", "lost.glb"))
    Path(good).write_bytes(noop)
    Path(bad).write_bytes(fixtures.BROKEN["truncated_glb"].data)
    run = call("inspect", bad, good, lost, "--format", "json")
    assert run.code == 3
    assert [facts["file"] for facts in run.json["files"]] == [good]
    assert [line.split(": ")[1] for line in run.err.splitlines()] == [bad, lost]
    clip = call("inspect", good, bad, "--clip", "nowhere")
    assert clip.code == 5  # the worst of 5 and 3


def test_codes_and_breaks_in_names_are_shown_not_obeyed(call: Call, fixture: Fixture) -> None:
    path = fixture("gltf_embedded")
    path.write_bytes(path.read_bytes().replace(b'"slide"', rb'"a\u001b[31m\nb\ud83d"'))
    text = call("inspect", path, "--tracks").product().decode()
    assert r"a\x1b[31m\nb\ud83d" in text
    assert "\x1b" not in text
    assert by_name(only(call, path)).keys() == {"a\x1b[31m\nb\ud83d"}
    assert len(table(call("inspect", path, "--format", "csv").product())) == 1


def test_a_folder_is_refused_with_a_way_out(call: Call, tmp_path: Path) -> None:
    run = call("inspect", tmp_path)
    assert refusal(run, 3) == f"gltf-anim: {tmp_path}: is a folder"
    assert run.err.splitlines()[1] == f"help: name the files: {tmp_path}/*.glb"


@pytest.mark.parametrize("name", REAL)
def test_real_files_give_finite_numbers(name: str, call: Call, asset: Find) -> None:
    path = asset(name)
    facts = only(call, path, "--tracks")
    assert facts["clips"]
    assert sum(clip["share"] for clip in facts["clips"]) < 1.01
    for clip in facts["clips"]:
        assert len(clip["track_list"]) == sum(clip["tracks"].values())
        assert sum(track["keys"] for track in clip["track_list"]) == clip["keys"]
        assert clip["redundant_keys"] == sum(track["redundant_keys"] for track in clip["track_list"])
    assert path.name in call("inspect", path).product().decode()


def test_known_numbers_of_known_files(call: Call, asset: Find) -> None:
    knight = only(call, asset("Knight.glb"))
    assert len(knight["clips"]) == 76
    assert sum(sum(clip["tracks"].values()) for clip in knight["clips"]) == 8712
    assert knight["skins"][0]["joints"] == 41
    fox = by_name(only(call, asset("Fox.glb")))
    assert {name: clip["frame_rate_fps"] for name, clip in fox.items() if name != "Run"} == {"Survey": 24, "Walk": 24}
    drone = only(call, asset("BusterDrone/busterDrone.gltf"))
    assert sum(drone["clips"][0]["tracks"].values()) == 99
    assert {finding["where"] for finding in drone["findings"] if finding["name"] == "missing-file"} == {
        "image 7",
        "image 11",
    }


def test_fail_on_makes_it_a_gate(call: Call, fixture: Fixture) -> None:
    path = fixture("noop")
    assert call("inspect", path, "--fail-on", "error").code == 0
    run = call("inspect", path, "--fail-on", "warning", "--format", "json")
    assert run.code == 6
    assert run.json["files"]
    assert run.err.startswith("gltf-anim: ")
    assert "warning" in run.err
