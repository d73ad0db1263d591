"""`inspect`: counts agree with a plain reader, every fault has its finding, and real files give known numbers."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fixtures
from anim.gltf.document import copy_json
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.inspecting import Json, by_name, only
from tests.cli.playing import Player
from tests.cli.running import built
from tests.clips import track
from tests.files import REAL, glb_of, mark_slow, opened
from tests.fixtures.reading import decode, split


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
        "constant": (1, 0, 23, 0, 0, 0),  # the last key holds the clip's end
        "at_rest": (3, 3, 2, 0, 0, 0),
        "straight": (0, 0, 23, 0, 0, 0),
        "signs": (0, 0, 23, 0, 24, 0),
        "non_unit": (0, 0, 0, 1, 0, 0),  # players that don't normalize need the key
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
        "redundant-keys": "info",
        "late-start": "info",
        "one-instant": "info",
        "end-frame": "info",
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


def test_bytes_of_compressed_keys_are_those_in_the_file(call: Call) -> None:
    """Keys that compress well take more bytes decoded than the whole file has; the shares are of what is stored."""
    values = np.zeros((5000, 3))
    values[:, 0] = np.arange(5000) // 100
    moving = track("translation", np.arange(5000) / 64, values)
    document = writer.replace_clips(
        opened(built("gltf_embedded")), {0: Clip("slide", (moving,))}, extension="EXT_meshopt_compression"
    )
    data = glb_of(document)
    facts = only(call, data)
    assert facts["animation_data_bytes"] == 5000 * (4 + 12) > len(data)
    compact, blob = split(data)
    views = [compact["bufferViews"][n]["extensions"]["EXT_meshopt_compression"] for n in _key_views(compact)]
    assert facts["animation_stored_bytes"] == sum(view["byteLength"] for view in views) < len(blob)
    (slide,) = facts["clips"]
    assert slide["stored_bytes"] == facts["animation_stored_bytes"]
    assert slide["share"] == pytest.approx((slide["stored_bytes"] + slide["json_bytes"]) / len(data))
    page = call("inspect", "-", stdin=data).product().decode()
    share = int(re.search(r"\((\d+) % of the file\)", page)[1])  # type: ignore[index]
    assert share < 100
    assert "(80 kB decoded)" in page


def _key_views(document: Json) -> set[int]:
    samplers = document["animations"][0]["samplers"]
    return {document["accessors"][s[key]]["bufferView"] for s in samplers for key in ("input", "output")}


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
    assert skin["worst_sum_error"] == 0, "rounding does not count"


def test_a_skin_is_counted_with_repeated_primitives(call: Call) -> None:
    document = opened(built("biped"))
    json = copy_json(document.json)
    primitives = json["meshes"][0]["primitives"]
    primitives += primitives[-1:] * 3
    (skin,) = only(call, glb_of(replace(document, json=json)))["skins"]
    weights = np.concatenate([each.mesh.weights for each in reader.scene(replace(document, json=json)).instances])
    assert skin["vertices"] == len(weights)
    assert skin["mean_influences"] == pytest.approx((weights > 0).sum(axis=1).mean())


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


def test_two_clips_of_one_name_are_found(noop: bytes, call: Call) -> None:
    document = opened(noop)
    assert "duplicate-clip-names" not in names_of_findings(only(call, noop))
    document.json["animations"][2]["name"] = document.json["animations"][0]["name"]
    findings = only(call, glb_of(document))["findings"]
    found = next(each for each in findings if each["name"] == "duplicate-clip-names")
    assert (found["severity"], found["problem"]) == ("warning", "2 clips have this name (numbers 0, 2)")


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


@pytest.mark.parametrize("name", ["gltf_external", "gltf_embedded"])
def test_text_files_count_with_their_buffers(name: str, fixture: Fixture, call: Call) -> None:
    path = fixture(name)
    sizes = {file: len(data) for file, data in fixtures.build_files(name).items()}
    facts = only(call, path)
    assert facts["file"] == str(path)
    assert facts["bytes"] == sum(sizes.values())
    assert [clip["name"] for clip in facts["clips"]] == ["slide"]


@pytest.mark.parametrize("name", ["invalid_uri_data", "not_found", "invalid_uri_scheme"])
def test_a_buffer_that_nothing_refers_to_is_read_too(name: str, call: Call, bad_input: Find, tmp_path: Path) -> None:
    path = bad_input(f"buffer/{name}.gltf")
    run = call("inspect", path, "--format", "json")
    assert (run.code, call("convert", path, tmp_path / "out.glb").code) == (3, 3)
    assert [(each["name"], each["where"]) for each in run.json["files"][0]["findings"]] == [("invalid", "buffer 0")]


def test_a_buffer_or_image_that_is_not_there_is_a_finding(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "scene.gltf"
    content = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 4, "uri": "lost%20data.bin"}],
        "images": [{"uri": "there.png"}, {"uri": "lost.png"}, {"uri": "data:image/png;base64,AAAA"}],
    }
    path.write_text(json.dumps(content))
    (tmp_path / "there.png").touch()
    run = call("inspect", path, "--format", "json")
    assert run.code == 3
    found = [(f["name"], f["where"], f["problem"]) for f in run.json["files"][0]["findings"]]
    assert found == [
        ("invalid", "buffer 0", "'lost data.bin' is not beside the file"),
        ("missing-file", "image 1", "'lost.png' is not beside the file"),
    ]
    assert "healthy" not in call("inspect", path).text


@pytest.mark.parametrize(
    ("name", "finding"),
    [
        ("draco", "invalid-vertices"),
        ("unknown_required_extension", "unknown-extension"),
        ("joints_out_of_range", "invalid-vertices"),
    ],
)
def test_what_does_not_concern_the_animation_is_a_finding(name: str, finding: str, call: Call) -> None:
    assert finding in names_of_findings(only(call, fixtures.BROKEN[name].data))


@pytest.mark.parametrize("name", mark_slow(REAL))
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
