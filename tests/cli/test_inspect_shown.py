"""`inspect` to people and to gates: the text, the table, several files, refusals, and exit codes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

import fixtures
from anim.gltf.io.json_text import dump
from tests.cli.conftest import Call, Fixture
from tests.cli.inspecting import by_name, only
from tests.cli.running import built, refusal, table
from tests.files import glb_of, opened_fixture


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
    assert text.startswith(f"stdin  {len(noop) / 1000:.3g} kB: 1 node, 1 mesh, 36 vertices, 0 skins, 9 clips\n")
    for clip in by_name(only(call, noop)):
        assert clip in text
    for finding in only(call, noop)["findings"]:
        assert f"{finding['name']}: {finding['where']}: {finding['problem']}; {finding['advice']}" in text
    listed = call("inspect", "-", "--tracks", "--clip", "half_turn", stdin=noop).product().decode()
    assert "tracks of half_turn" in listed
    assert "179.0°" in listed


def test_a_sound_file_is_called_healthy(call: Call) -> None:
    assert "healthy" in call("inspect", "-", stdin=built("arm")).product().decode()


def test_of_several_files_a_bad_one_is_reported_and_the_others_go_on(noop: bytes, call: Call, tmp_path: Path) -> None:
    good, bad, lost = (str(tmp_path / name) for name in ("good.glb", "bad.glb", "lost.glb"))
    Path(good).write_bytes(noop)
    Path(bad).write_bytes(fixtures.BROKEN["truncated_glb"].data)
    run = call("inspect", bad, good, lost, "--format", "json")
    assert run.code == 3
    assert [facts["file"] for facts in run.json["files"]] == [bad, good, lost]
    assert [facts["error"] is None for facts in run.json["files"]] == [False, True, False]
    assert run.json["files"][2]["error"] == "can't be read (no such file or directory)"
    assert all(facts.keys() == run.json["files"][1].keys() for facts in run.json["files"])
    faults = [line for line in run.err.splitlines() if not line.startswith("help: ")]
    assert [line.split(": ")[1] for line in faults] == [bad, lost]
    rows = table(call("inspect", bad, good, lost, "--format", "csv").out)
    assert [row["file"] for row in rows if row["error"]] == [bad, lost]
    assert {row["file"] for row in rows if not row["error"]} == {good}
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
    run = call("sample", tmp_path, "-", "--fps", "1")
    assert refusal(run, 3) == f"gltf-anim: {tmp_path}: is a folder"
    assert run.err.splitlines()[1] == "help: name a file (there is no .glb in it)"
    for name in ("b.glb", "a.glb"):
        (tmp_path / name).write_bytes(built("noop"))
    run = call("sample", tmp_path, "-", "--fps", "1")
    advised = run.err.splitlines()[1].removeprefix("help: name a file in it, such as ")
    assert advised == str(tmp_path / "a.glb")
    assert call("inspect", advised).code == 0


def test_a_name_that_looks_like_an_option_is_advised_as_a_path(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "-o.glb").write_bytes(built("noop"))
    run = call("sample", ".", "-", "--fps", "1")
    advised = run.err.splitlines()[1].removeprefix("help: name a file in it, such as ")
    assert advised == "./-o.glb"
    assert call("inspect", advised).code == 0


def test_of_a_broken_file_what_can_be_read_is_shown(call: Call, tmp_path: Path) -> None:
    content = json.loads(dump(opened_fixture("biped").json))
    content["animations"][1]["samplers"][0]["input"] = 999
    content["skins"][0]["skeleton"] = 999
    path = tmp_path / "biped.glb"
    path.write_bytes(glb_of(replace(opened_fixture("biped"), json=content)))
    run = call("inspect", path, "--format", "json")
    assert run.code == 3
    (file,) = run.json["files"]
    assert [clip["name"] for clip in file["clips"]] == ["walk", "jump"]
    assert file["clips"][0] == only(call, built("biped"))["clips"][0] | {"share": file["clips"][0]["share"]}
    assert len(file["skins"]) == 1
    faults = [each for each in file["findings"] if each["name"] == "invalid"]
    assert [each["where"] for each in faults] == ["animations[1].samplers[0].input", "skins[0].skeleton"]
    assert file["error"] == "animations[1].samplers[0].input: is 999 (the file has 91 accessors)"
    assert run.err.splitlines()[0] == f"gltf-anim: {path}: {file['error']}"
    assert call("inspect", path, "--fail-on", "error").code == 3  # broken, before anything is judged
    assert "walk" in call("inspect", path, "--continuity", "--tracks").text


def test_a_cut_off_file_shows_what_its_json_says(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "cut.glb"
    path.write_bytes(built("biped")[:-1000])
    run = call("inspect", path)
    assert run.code == 3
    assert "GLB is truncated" in run.text
    assert "1 skin" in run.text


def test_quiet_leaves_the_text_out_and_nothing_that_was_asked_for(call: Call, fixture: Fixture) -> None:
    path = fixture("noop")
    assert call("inspect", path, "-q") == (0, b"", "")
    assert call("inspect", path, "-q", "--fail-on", "warning").code == 6
    assert call("inspect", path, "-q", "--format", "json").json["files"]
    assert call("diff", path, path, "-q") == (0, b"", "")
    assert call("diff", path, path, "-q", "--format", "json").json["clips"]


def test_fail_on_makes_it_a_gate(call: Call, fixture: Fixture) -> None:
    path = fixture("noop")
    assert call("inspect", path, "--fail-on", "error").code == 0
    run = call("inspect", path, "--fail-on", "warning", "--format", "json")
    assert run.code == 6
    assert run.json["files"]
    assert run.err.startswith("gltf-anim: ")
    assert "warning" in run.err


def test_unreadable_clips_are_counted(call: Call, tmp_path: Path) -> None:
    """A track of one key and 21 values: that clip can't be read, the file has it nevertheless."""
    document = opened_fixture("biped")
    content = json.loads(dump(document.json))
    sampler = content["animations"][1]["samplers"][0]
    content["accessors"].append({**content["accessors"][sampler["input"]], "count": 1})
    sampler["input"] = len(content["accessors"]) - 1
    path = tmp_path / "in.glb"
    path.write_bytes(glb_of(replace(document, json=content)))
    assert ", 2 clips and 1 unreadable\n" in call("inspect", path).text
    (facts,) = call("inspect", path, "--format", "json").json["files"]
    assert (len(facts["clips"]), facts["unreadable_clips"]) == (2, 1)


def test_severities_are_shown_as_fail_on_takes_them(call: Call, fixture: Fixture) -> None:
    path = fixture("biped")
    shown = {line.split()[0] for line in call("inspect", path).text.splitlines() if "gltf-anim optimize" in line}
    assert shown == {"info"}
    assert call("inspect", path, "--fail-on", *shown).code == 6


def test_a_file_that_is_not_there_is_not_to_be_fixed(call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(built("arm"))
    problem = "can't be read (no such file or directory)"
    for name, advice in (
        ("lost.glb", "correct its name"),
        ("ab.glb", "did you mean 'a.glb'?"),
        ("lost/a.glb", f"there is no folder '{tmp_path / 'lost'}'"),
    ):
        run = call("inspect", tmp_path / "a.glb", tmp_path / name)
        assert run.code == 3
        assert f"{problem}; {advice}\n" in run.text
        assert run.err == f"gltf-anim: {tmp_path / name}: {problem}\nhelp: {advice}\n"
        assert call("inspect", tmp_path / name).err == run.err


def test_folders_and_patterns_are_inspected(call: Call, tmp_path: Path) -> None:
    (tmp_path / "crowd").mkdir()
    for name in ("b.glb", "a.glb"):
        (tmp_path / "crowd" / name).write_bytes(built("arm"))
    for words in (tmp_path, f"{tmp_path}/**/*.glb"):
        files = call("inspect", words, "--format", "json").json["files"]
        assert [Path(each["file"]).name for each in files] == ["a.glb", "b.glb"]
    assert call("inspect", f"{tmp_path}/*.gltf").code == 3
