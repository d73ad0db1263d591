"""`sample`: values agree with a plain player, in three formats, for the nodes and times that were asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.cli.conftest import Call, Find, Fixture
from tests.cli.playing import Player, apart
from tests.cli.running import built, help_line, refusal, table

TIMES = (-1.0, 0.0, 0.11, 0.5, 0.7071, 1.0, 1.93, 99.0)  # s: outside, on keys, between them
TOLERANCE = 1e-6  # files hold float32


def at(times: tuple[float, ...] = TIMES) -> list[str]:
    return [f"--at={time}" for time in times]


@pytest.mark.parametrize("name", ["interpolations", "biped", "morph_cube", "noop", "accessors", "arm"])
def test_local_values_are_those_of_a_plain_player(name: str, call: Call) -> None:
    data = built(name)
    player = Player(data)
    clips = call("sample", "-", *at(), stdin=data).json["clips"]
    assert [clip["clip"] for clip in clips] == player.names()
    for number, clip in enumerate(clips):
        assert clip["index"] == number
        assert clip["times_s"] == list(TIMES)
        for f, time in enumerate(TIMES):
            for node, expected in enumerate(player.local(number, time)):
                found = clip["nodes"][node]
                assert found["name"] == player.nodes[node]["name"]
                for path, key in PATHS.items():
                    if path in expected:
                        error = apart(path, np.array(found[key][f]), expected[path])
                        assert error < TOLERANCE, (clip["clip"], found["name"], path, time)


PATHS = {"translation": "translation_m", "rotation": "rotation_xyzw", "scale": "scale", "weights": "weights"}


@pytest.mark.parametrize("clip", ["walk", "jump"])
def test_world_values_are_those_of_a_plain_player(clip: str, call: Call, tmp_path: Path) -> None:
    data = built("biped")
    player = Player(data)
    number = player.names().index(clip)
    options = ["--clip", clip, "--space", "world", *at()]
    document = call("sample", "-", *options, stdin=data).json
    assert document["space"] == "world"
    (found,) = document["clips"]
    call("sample", "-", tmp_path / "poses.npz", *options, stdin=data).product()
    with np.load(tmp_path / "poses.npz", allow_pickle=False) as arrays:
        matrices = arrays["world_from_node"]
    for f, time in enumerate(TIMES):
        expected = player.world(number, time)
        assert matrices[f] == pytest.approx(expected, abs=TOLERANCE)
        for i, node in enumerate(found["nodes"]):
            assert node["translation_m"][f] == pytest.approx(expected[i, :3, 3], abs=TOLERANCE)
            turned = Rotation.from_quat(node["rotation_xyzw"][f]).as_matrix()
            assert turned == pytest.approx(expected[i, :3, :3], abs=1e-5)  # nothing is scaled here


def test_without_times_the_clips_own_keys_are_taken(call: Call) -> None:
    (clip,) = call("sample", "-", stdin=built("interpolations")).json["clips"]
    assert clip["times_s"] == [0, 0.5, 1, 2]


def test_frames_end_exactly_at_the_clips_end(call: Call) -> None:
    late, open_loop = (
        call("sample", "-", "--clip", name, "--fps", "4", stdin=built("noop")).json["clips"][0]["times_s"]
        for name in ("late", "open_loop")
    )
    assert late == [0.5, 0.75, 1.0, 1.25, 1.5]
    assert open_loop == pytest.approx([0, 0.25, 0.5, 0.75, 23 / 24])


def test_the_json_is_one_document_with_units_in_its_keys(call: Call) -> None:
    document = call("sample", "-", "--at", "0", stdin=built("morph_cube")).json
    assert document["schema"] == 1
    assert set(document) == {"schema", "space", "clips"}
    assert [set(clip) for clip in document["clips"]] == [{"clip", "index", "times_s", "nodes"}] * 2
    node = document["clips"][0]["nodes"][0]
    assert set(node) == {"index", "name", "translation_m", "rotation_xyzw", "scale", "weights"}
    assert node["weights"] == [pytest.approx([0, 0.25, 0])]


def test_pointer_tracks_are_sampled_too(call: Call) -> None:
    clips = call("sample", "-", "--at", "0.25", "--clip", "color", stdin=built("pointer")).json["clips"]
    (values,) = clips[0]["pointers"]["/materials/0/pbrMetallicRoughness/baseColorFactor"]
    assert values == pytest.approx([0.5, 0.5, 0.1, 1.0])


def test_csv_is_one_table_of_the_same_numbers(call: Call) -> None:
    data = built("interpolations")
    (clip,) = call("sample", "-", *at(), stdin=data).json["clips"]
    rows = table(call("sample", "-", *at(), "--format", "csv", stdin=data).product())
    assert len(rows) == len(TIMES) * len(clip["nodes"])
    for row in rows:
        f, node = list(TIMES).index(float(row["time_s"])), clip["nodes"][int(row["node"])]
        assert (row["clip"], row["name"]) == ("move", node["name"])
        found = [float(row[key]) for key in ("tx_m", "ty_m", "tz_m", "qx", "qy", "qz", "qw", "sx", "sy", "sz")]
        expected = node["translation_m"][f] + node["rotation_xyzw"][f] + node["scale"][f]
        assert found == pytest.approx(expected, rel=1e-8, abs=1e-12)


def test_npz_holds_arrays_that_numpy_reads_without_pickle(call: Call, tmp_path: Path) -> None:
    data = built("biped")
    call("sample", "-", tmp_path / "poses.npz", "--clip", "walk", "--node", "*_foot", *at(), stdin=data).product()
    (clip,) = call("sample", "-", "--clip", "walk", "--node", "*_foot", *at(), stdin=data).json["clips"]
    with np.load(tmp_path / "poses.npz", allow_pickle=False) as arrays:
        assert arrays["times_s"].tolist() == list(TIMES)
        assert arrays["names"].tolist() == [node["name"] for node in clip["nodes"]]
        for key, size in (("translation_m", 3), ("rotation_xyzw", 4), ("scale", 3)):
            assert arrays[key].shape == (len(TIMES), 2, size)
            assert arrays[key].tolist() == np.stack([node[key] for node in clip["nodes"]], axis=1).tolist()
        assert "world_from_node" not in arrays


@pytest.mark.parametrize(("ending", "start"), [("json", b'{"schema"'), ("csv", b"clip,time_s,"), ("npz", b"PK")])
def test_the_format_follows_the_files_ending(ending: str, start: bytes, call: Call, tmp_path: Path) -> None:
    data = built("arm")
    out = tmp_path / f"poses.{ending.upper()}"
    assert call("sample", "-", out, "--at", "0", "--clip", CLIP_OF_ARM, stdin=data) == (0, b"", "")
    assert out.read_bytes().startswith(start)
    piped = call("sample", "-", "--at", "0", "--clip", CLIP_OF_ARM, "--format", ending, stdin=data)
    assert piped.product().startswith(start)


CLIP_OF_ARM = Player(built("arm")).names()[0]


def test_globs_choose_clips_and_nodes(call: Call) -> None:
    data = built("biped")
    options = ["--at", "0", "--clip", "w*", "--node", "hips", "--node", "*_toe"]
    clips = call("sample", "-", *options, stdin=data).json["clips"]
    assert [clip["clip"] for clip in clips] == ["walk", "wave"]
    assert [node["name"] for node in clips[0]["nodes"]] == ["hips", "left_toe", "right_toe"]


def test_an_unnamed_clip_is_called_by_its_number(call: Call, asset: Find) -> None:
    rows = table(call("sample", asset("CesiumMan.glb"), "--clip", "0", "--at", "1", "--format", "csv").product())
    assert {row["clip"] for row in rows} == {"#0"}


def test_names_that_utf8_cannot_hold_do_not_stop_it(call: Call, fixture: Fixture) -> None:
    path = fixture("gltf_embedded")
    path.write_bytes(path.read_bytes().replace(b'"slide"', rb'"\ud83d,\n"'))
    assert call("sample", path, "--at", "0").json["clips"][0]["clip"] == "\ud83d,\n"
    rows = table(call("sample", path, "--at", "0", "--format", "csv").product())
    assert {row["clip"] for row in rows} == {"\\ud83d,\n"}


def test_a_file_without_clips_gives_an_empty_document(call: Call) -> None:
    bare = b'{"asset": {"version": "2.0"}, "nodes": [{"name": "a"}]}'
    assert call("sample", "-", stdin=bare).json["clips"] == []
    assert table(call("sample", "-", "--format", "csv", stdin=bare).product()) == []
    assert "no clip" in refusal(call("sample", "-", "--format", "npz", stdin=bare), 5)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--at", "0", "--fps", "30"], "--at and --fps exclude each other"),
        (["--fps", "0"], "--fps is 0 (expected a number above 0)"),
        (["--fps", "-24"], "--fps is -24"),
        (["--at", "nan"], "'nan' is no finite number"),
        (["--at", "soon"], "'soon' is no number"),
        (["--format", "npz"], "NPZ holds one clip, but 3 are chosen"),
    ],
)
def test_wrong_options(options: list[str], words: str, call: Call) -> None:
    assert words in refusal(call("sample", "-", *options, stdin=built("biped")), 2)


@pytest.mark.parametrize("name", ["walk.glb", "poses.txt", "poses.json.bak"])
def test_a_file_of_another_kind_is_never_written_over(name: str, call: Call, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"precious")
    run = call("sample", "-", tmp_path / name, stdin=built("arm"))
    assert "expected .json, .csv or .npz" in refusal(run, 2)
    assert "--format" in help_line(run)
    assert (tmp_path / name).read_bytes() == b"precious"
    call("sample", "-", tmp_path / name, "--format", "csv", stdin=built("arm")).product()
    assert table((tmp_path / name).read_bytes())


def test_a_missing_folder_is_named_before_any_work(call: Call, tmp_path: Path) -> None:
    run = call("sample", tmp_path / "nowhere.glb", tmp_path / "no" / "poses.csv")
    assert "poses.csv: there is no folder" in refusal(run, 3)
