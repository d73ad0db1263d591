"""`inspect` to people and to gates: the text, the table, several files, refusals, and exit codes."""

from __future__ import annotations

from pathlib import Path

import fixtures
from tests.cli.conftest import Call, Fixture
from tests.cli.inspecting import by_name, only
from tests.cli.running import built, refusal, table


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


def test_fail_on_makes_it_a_gate(call: Call, fixture: Fixture) -> None:
    path = fixture("noop")
    assert call("inspect", path, "--fail-on", "error").code == 0
    run = call("inspect", path, "--fail-on", "warning", "--format", "json")
    assert run.code == 6
    assert run.json["files"]
    assert run.err.startswith("gltf-anim: ")
    assert "warning" in run.err
