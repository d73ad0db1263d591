"""`diff`: two files, their clips, and a gate."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip
from tests.anim.show.reading import words
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import help_line, refusal
from tests.cli.test_diff_matching import saved
from tests.clips import about, clip, track
from tests.files import opened_fixture, opened_path

LIFT = 0.0005  # m


@pytest.fixture
def lifted(tmp_path: Path) -> tuple[Path, Path]:
    """The biped, and the same with one key of its walk's hips half a millimeter higher."""
    document = opened_fixture("biped")
    return saved(tmp_path / "a.glb", document), saved(tmp_path / "b.glb", _lifted(document))


def test_a_file_is_0_away_from_itself(fixture: Fixture, call: Call) -> None:
    for name in ("biped", "morph_cube", "interpolations", "pointer", "tube"):
        path = fixture(name)
        found = call("diff", path, path, "--format", "json").json
        assert found["max_error_m"] == 0
        for each in found["clips"]:
            numbers = {key: value for key, value in each.items() if key.startswith(("max_", "p99", "mean"))}
            assert not any(numbers.values()), numbers
            assert (each["missing_tracks"], each["added_tracks"]) == ([], [])
            assert each["end_s"] == each["other_end_s"]
        assert found["files"][0] == found["files"][1]


def test_where_and_when_in_numbers(lifted: tuple[Path, Path], call: Call) -> None:
    found = call("diff", *lifted, "--format", "json").json
    assert found["schema"] == 1
    worst, *others = found["clips"]
    assert worst["clip"] == worst["other_clip"] == "walk"
    assert worst["max_error_m"] == pytest.approx(LIFT, rel=2e-3)
    assert worst["max_error_percent"] == pytest.approx(100 * LIFT / found["diagonal_m"], rel=2e-3)
    assert found["max_error_m"] == worst["max_error_m"]
    assert worst["max_error_m"] <= worst["certified_error_m"] <= 1.01 * LIFT  # a tent between keys: its tip is a key
    assert all(each["max_error_m"] == 0 for each in others)
    assert 0 < worst["mean_m"] < worst["p99_m"] <= worst["max_error_m"] * (1 + 1e-9)
    assert worst["max_angle_deg"] == 0
    walk = next(each for each in reader.clips(opened_path(lifted[0])) if each.name == "walk")
    hips = next(each for each in walk.tracks if each.path == "translation")
    assert worst["time_s"] == hips.times[7]
    step = float(np.diff(hips.times).min())
    assert worst["max_speed_error_m_per_s"] == pytest.approx(LIFT / step, rel=0.05)
    assert worst["joint"]
    assert isinstance(worst["vertex"], int)


def test_the_page_is_a_row_per_clip_and_a_line_that_says_it_all(lifted: tuple[Path, Path], call: Call) -> None:
    run = call("diff", *lifted)
    lines = run.text.splitlines()
    assert run.err == ""
    assert lines[0].split()[:4] == ["clip", "joint", "vertex", "time"]
    assert lines[1].startswith("walk ")
    assert "0.5 mm" in lines[1]
    assert any(line.startswith("3 clips compared, max 0.5 mm (0.0") and "in 'walk' at '" in line for line in lines)
    assert "a.glb → " in lines[-1]
    assert "animation" in lines[-1]


def test_a_gate(lifted: tuple[Path, Path], call: Call) -> None:
    assert call("diff", *lifted, "--fail-above", "0.6mm").code == 0
    assert call("diff", *lifted, "--fail-above", "0.1%").code == 0
    run = call("diff", *lifted, "--fail-above", "0.4mm")
    assert run.code == 6
    assert run.out  # the report all the same
    assert "b.glb: 0.5 mm (" in run.err
    assert run.err.rstrip().endswith("(limit 0.4 mm)")
    assert call("diff", *lifted, "--fail-above", "0.4mm", "--clip", "wave").code == 0
    assert call("diff", *lifted, "--fail-above", "0", "--clip", "wave").code == 0
    assert "(limit 0 mm)" in call("diff", *lifted, "--fail-above", "0mm").err


def test_a_missing_clip_is_named_and_stops_the_gate(tmp_path: Path, call: Call) -> None:
    document = opened_fixture("biped")
    kept = [each for each in document.json["animations"] if each["name"] != "walk"]
    less = replace(document, json={**document.json, "animations": kept})
    paths = saved(tmp_path / "a.glb", document), saved(tmp_path / "b.glb", less)
    page = call("diff", *paths)
    assert page.code == 0
    assert f"1 clip only in {paths[0]}: 'walk'" in page.text
    run = call("diff", *paths, "--fail-above", "1m")
    assert run.code == 6
    assert run.err == f"gltf-anim: {paths[1]}: clip 'walk' is missing\n"
    back = call("diff", *reversed(paths), "--format", "json", "--fail-above", "1m")
    assert back.code == 0
    assert back.json["added_clips"] == ["walk"]


def test_clips_are_chosen_by_the_first_files_names(lifted: tuple[Path, Path], call: Call) -> None:
    found = call("diff", *lifted, "--clip", "wa*", "--format", "json").json
    assert sorted(each["clip"] for each in found["clips"]) == ["walk", "wave"]
    run = call("diff", *lifted, "--clip", "wakl")
    assert "no clip matches 'wakl'" in refusal(run, 5)
    assert help_line(run) == "did you mean 'walk'?"


def test_one_of_both_may_be_a_pipe(lifted: tuple[Path, Path], call: Call) -> None:
    expected = call("diff", *lifted, "--format", "json").json["clips"]
    found = call("diff", "-", lifted[1], "--format", "json", stdin=lifted[0].read_bytes()).json
    assert (found["files"][0]["file"], found["clips"]) == ("stdin", expected)
    assert "both be stdin" in refusal(call("diff", "-", "-"), 2)


def test_a_shell_shows_nodes_without_vertices(tmp_path: Path, call: Call) -> None:
    """A camera beside the cubes of `interpolations` turns by 2°; off, nothing is seen to move."""
    document = opened_fixture("interpolations")
    nodes = [*document.json["nodes"], {"name": "camera"}]
    number = len(nodes) - 1
    document = replace(document, json={**document.json, "nodes": nodes, "scenes": _with_root(document, number)})
    turned = clip(*reader.clips(document)[0].tracks, track("rotation", [0], about("y", [2]), node=number))
    changed = writer.replace_clips(document, {0: Clip(reader.names(document)[0], turned.tracks)})
    paths = saved(tmp_path / "a.glb", document), saved(tmp_path / "b.glb", changed)
    found = call("diff", *paths, "--format", "json").json
    chord = 2 * np.sin(np.radians(1))
    assert found["shell_m"] == pytest.approx(0.01 * found["diagonal_m"])
    assert found["max_error_m"] == pytest.approx(chord * found["shell_m"], rel=2e-3)
    assert (found["clips"][0]["joint"], found["clips"][0]["vertex"]) == ("camera", None)
    assert found["clips"][0]["added_tracks"] == [{"target": "camera", "path": "rotation"}]
    wider = call("diff", *paths, "--format", "json", "--shell", "10cm").json
    assert wider["max_error_m"] == pytest.approx(0.1 * chord, rel=2e-3)
    assert call("diff", *paths, "--format", "json", "--shell", "0").json["max_error_m"] == 0


def test_a_picture(lifted: tuple[Path, Path], tmp_path: Path, call: Call) -> None:
    for ending, start in (("png", b"\x89PNG"), ("svg", b"<?xml")):
        run = call("diff", *lifted, "--plot", tmp_path / f"e.{ending}")
        assert run.code == 0
        assert (tmp_path / f"e.{ending}").read_bytes().startswith(start)
        assert f"e.{ending}  " in run.err
    assert "--plot writes .png or .svg" in refusal(call("diff", *lifted, "--plot", tmp_path / "e.jpg"), 2)
    assert "there is no folder" in refusal(call("diff", *lifted, "--plot", tmp_path / "no" / "e.png"), 3)


def test_a_picture_tells_two_files_of_one_name_apart(
    lifted: tuple[Path, Path], tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small").mkdir()
    lifted[1].rename(Path("small") / lifted[0].name)
    call("diff", lifted[0].name, f"small/{lifted[0].name}", "--plot", "e.svg").product()
    assert f"{lifted[0].name} → small/{lifted[0].name}" in words(Path("e.svg").read_bytes())


def test_a_picture_counts_what_it_leaves_out(asset: Find, tmp_path: Path, call: Call) -> None:
    """Of Fox's three clips one is another."""
    document = opened_path(asset("Fox.glb"))
    clips = reader.clips(document)
    other = writer.replace_clips(document, {1: replace(clips[1], tracks=clips[1].tracks[:-3])})
    changed = saved(tmp_path / "b.glb", other)
    call("diff", asset("Fox.glb"), changed, "--plot", tmp_path / "e.svg", "-q").product()
    said = words((tmp_path / "e.svg").read_bytes())
    assert "1 clip that differs, 2 without difference" in said
    assert sum("largest distance" in text for text in said) == 1


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (("--fail-above", "3deg"), "--fail-above is '3deg' (expected a length above 0"),
        (("--fail-above", "-1mm"), "--fail-above is '-1mm' (expected a length above 0"),
        (("--shell", "-1mm"), "--shell is '-1mm' (expected a length above 0"),
        (("--samples-per-second", "0"), "--samples-per-second is 0 (expected a number above 0)"),
        (("--player", "unity"), "'unity' is none of spec, three, raw, nlerp"),
    ],
)
def test_options_out_of_range(options: tuple[str, str], problem: str, lifted: tuple[Path, Path], call: Call) -> None:
    assert problem in refusal(call("diff", *lifted, *options), 2)


def test_bad_input_names_the_file_that_is_bad(lifted: tuple[Path, Path], tmp_path: Path, call: Call) -> None:
    broken = tmp_path / "broken.glb"
    broken.write_bytes(lifted[0].read_bytes()[:500])
    for pair in ((lifted[0], broken), (broken, lifted[0])):
        assert refusal(call("diff", *pair), 3).startswith(f"gltf-anim: {broken}: ")
    assert "nowhere.glb" in refusal(call("diff", lifted[0], tmp_path / "nowhere.glb"), 3)


def _lifted(document: Document) -> Document:
    number = reader.names(document).index("walk")
    walk = reader.clips(document)[number]
    index = next(i for i, each in enumerate(walk.tracks) if each.path == "translation")
    values = walk.tracks[index].values.copy()
    values[7, 1] += LIFT
    tracks = (*walk.tracks[:index], replace(walk.tracks[index], values=values), *walk.tracks[index + 1 :])
    return writer.replace_clips(document, {number: Clip(walk.name, tracks)})


def test_an_edit_states_the_errors_that_diff_finds(tmp_path: Path, call: Call) -> None:
    """A camera swings by 90°, while the mesh beside it moves little; both lines have both figures and their places."""
    document = opened_fixture("arm")
    nodes = [*document.json["nodes"], {"name": "camera"}]
    number = len(nodes) - 1
    document = replace(document, json={**document.json, "nodes": nodes, "scenes": _with_root(document, number)})
    swing = track("rotation", np.linspace(0, 1, 5), about("y", [0, 90, 0, 90, 0]), node=number)
    tracks = (*reader.clips(document)[0].tracks, swing)
    path = saved(tmp_path / "a.glb", writer.replace_clips(document, {0: Clip("swing", tracks)}))
    edit = call("resample", path, tmp_path / "b.glb", "--fps", "1.4")
    alone = call("resample", path, "-", "--fps", "1.4", "--node", "camera", "--dry-run")
    compared = call("diff", path, tmp_path / "b.glb").text
    place = "around 'camera', which moves no vertex, "
    stated = re.search(rf", max (\S+ \S+) .* s, max (\S+ \S+) \(.* %\) {place}", edit.err)
    assert stated, edit.err
    vertices, around = stated.groups()
    assert f"max {around} (" in compared
    assert f"in 'swing' {place}" in compared
    assert f"; vertices: max {vertices} (--shell 0)\n" in compared
    assert f", max 0 mm, max {around} (" in alone.err
    bare = call("diff", path, tmp_path / "b.glb", "--shell", "0").text
    assert f"max {vertices} (" in bare
    assert place not in bare


def _with_root(document: Document, node: int) -> list[dict[str, Any]]:
    scenes: list[dict[str, Any]] = json.loads(json.dumps(document.json["scenes"]))
    scenes[0]["nodes"].append(node)
    return scenes


def test_the_moment_before_a_key_counts(tmp_path: Path, call: Call) -> None:
    """Quaternions too long, played as three.js does: an arc as it is, too large, up to a key; from it on the chord,
    normalized. No time that is looked at first shows the end of the arc."""
    document = opened_fixture("biped")
    joint = next(t.node for t in reader.clips(document)[0].tracks if t.path == "rotation")
    keys = about("z", [0, 60, 61, 62])
    true = clip(track("rotation", [0, 0.5, 1, 1.5], keys, node=joint), name="walk")
    long = clip(track("rotation", [0, 0.5, 1, 1.5], keys * [[1], [1.007], [1.007], [1]], node=joint), name="walk")
    paths = [
        saved(tmp_path / f"{i}.glb", writer.replace_clips(document, {0: each})) for i, each in enumerate((true, long))
    ]
    options = ("--clip", "walk", "--format", "json", "--player")
    (three,) = call("diff", *paths, *options, "three").json["clips"]
    assert 0.4999 < three["time_s"] < 0.5
    assert three["max_error_m"] <= three["certified_error_m"] <= 1.01 * three["max_error_m"]


def test_one_file_as_two_players_show_it(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    """A quarter turn in one piece: nlerp lags behind slerp, most where sin(uθ)/(sin(uθ)+sin((1-u)θ)) does."""
    arm = fixture("arm")
    found = call("diff", arm, "--players", "spec,nlerp", "--format", "json").json
    assert found["player"] == "spec,nlerp"
    u, half = np.linspace(0, 1, 100_001), np.radians(45)
    chord = np.arctan2(u * np.sin(half), 1 - u + u * np.cos(half))
    lag = np.degrees(2 * np.abs(chord - u * half).max())
    assert {each["clip"]: each["max_angle_deg"] for each in found["clips"]} == pytest.approx(
        {"twist": lag, "bend": lag}, rel=1e-3
    )
    assert all(each["certified_error_m"] is None for each in found["clips"])
    assert call("diff", arm, "--players", "nlerp,spec", "--format", "json").json["max_error_m"] == pytest.approx(
        found["max_error_m"], rel=1e-4
    )
    run = call("diff", arm, "--players", "spec,nlerp", "--plot", tmp_path / "p.svg")
    assert "arm.glb, as shown by spec and nlerp" in run.text
    assert "arm.glb: spec → nlerp" in words((tmp_path / "p.svg").read_bytes())


@pytest.mark.parametrize(
    ("args", "problem"),
    [
        ([], "B is missing"),
        (["arm.glb", "--players", "spec,nlerp"], "--players is about one file"),
        (["--players", "spec"], "expected two different ones"),
        (["--players", "spec,unity"], "players are 'spec,unity'"),
    ],
)
def test_players_that_can_t_be_compared(args: list[str], problem: str, fixture: Fixture, call: Call) -> None:
    assert problem in refusal(call("diff", fixture("arm"), *args), 2)


@pytest.mark.parametrize("line", ["diff IN IN --fail-above 1", "bake IN out.glb --clip walk --max-error 1 --fps 4"])
def test_a_bound_without_a_unit_is_a_warning(line: str, walk: Path, call: Call, tmp_path: Path) -> None:
    """A limit of a metre passes everything: it was likely meant as millimetres or percent."""
    words = [{"IN": walk, "out.glb": tmp_path / "out.glb"}.get(word, word) for word in line.split()]
    option = next(word for word in line.split() if word.endswith(("-above", "-error")))
    run = call(*words, "-q")
    assert run.code == 0
    assert f"warning: {option} 1 means 1 m, for want of a unit" in run.err
