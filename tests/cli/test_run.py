"""`run`: recipes over folders, their cache and journal."""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import Call, Fixture
from tests.cli.running import built, refusal
from tests.cli.running_recipes import STEPS, journal, write_crowd, write_recipe

PLAIN = ("resample --fps 12",)


@pytest.mark.slow
def test_the_output_is_that_of_single_commands(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped", cube="morph_cube")
    write_recipe(folder)
    assert call("run", "crowd/hero.glb", "crowd/cube.glb").code == 0
    for name in ("hero", "cube"):
        made = call("resample", f"crowd/{name}.glb", "--fps", "30").product()
        made = call(*STEPS[1].split(), stdin=made).product()
        assert (folder / "build" / "crowd" / f"{name}.glb").read_bytes() == made


@pytest.mark.parametrize("step", ["resample --fps 12", "convert", "convert --embed", "optimize --effort fast"])
def test_a_text_is_that_of_a_single_command(step: str, folder: Path, call: Call, fixture: Fixture) -> None:
    """The product of a step is a GLB, in which a buffer is no data URI and the text has no indent."""
    (folder / "single").mkdir()
    for name in ("gltf_embedded", "gltf_external"):
        fixture(name)
        command, *options = step.split()
        call(command, f"{name}.gltf", f"single/{name}.gltf", *options).product()
    write_recipe(folder, step, match="*.gltf", out="build/{name}")
    for state in ("made", "cached"):
        assert f"2 {state}" in call("run").err
        expected = {path.name: path.read_bytes() for path in (folder / "single").iterdir()}
        assert {path.name: path.read_bytes() for path in (folder / "build").iterdir()} == expected
        shutil.rmtree(folder / "build")


def test_a_last_step_embeds_buffers_of_a_text(folder: Path, call: Call) -> None:
    write_recipe(folder, *PLAIN, "convert --embed", out="build/{stem}.gltf")
    call("run").product()
    assert [path.name for path in (folder / "build").iterdir()] == ["arm 1.gltf"]


def test_a_second_run_makes_nothing(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped")
    write_recipe(folder, *PLAIN)
    first = call("run")
    assert "2 files: 2 made" in first.err
    stamp = (folder / "build/crowd/hero.glb").stat().st_mtime_ns
    assert call("run").err.startswith("2 files: 2 cached")
    assert (folder / "build/crowd/hero.glb").stat().st_mtime_ns == stamp
    (folder / "crowd/hero.glb").write_bytes(built("morph_cube"))
    assert "2 files: 1 made, 1 cached" in call("run").err
    (folder / "crowd/hero.glb").write_bytes(built("biped"))
    assert call("run").err.startswith("2 files: 2 cached")  # of the first run
    assert (folder / "build/crowd/hero.glb").read_bytes() == call("resample", "crowd/hero.glb", "--fps", "12").product()


def test_a_lost_or_changed_output_comes_from_the_cache(folder: Path, call: Call) -> None:
    write_recipe(folder, *PLAIN)
    call("run").product()
    output = folder / "build/crowd/arm 1.glb"
    made = output.read_bytes()
    for change in (output.unlink, lambda: output.write_bytes(b"other")):
        change()
        assert call("run").err.startswith("1 file: 1 cached")
        assert output.read_bytes() == made


def test_a_damaged_cache_is_made_again(folder: Path, call: Call) -> None:
    write_recipe(folder, *PLAIN)
    call("run").product()
    made = (folder / "build/crowd/arm 1.glb").read_bytes()
    for path in (folder / ".gltf-anim-cache/objects").rglob("*"):
        if path.is_file():
            path.write_bytes(b"damaged")
    shutil.rmtree(folder / "build")
    assert "1 file: 1 made" in call("run").err
    assert (folder / "build/crowd/arm 1.glb").read_bytes() == made


def test_other_steps_and_files_named_in_steps_are_other_results(folder: Path, call: Call) -> None:
    (folder / "motion").mkdir()
    (folder / "motion/walk.bvh").write_bytes(call("to-euler", "noop.glb", "-", "--clip", "#0").product())
    (folder / "hero.glb").write_bytes(built("noop"))
    recipe = {"match": "motion/*.bvh", "out": "build/{stem}.glb"}
    write_recipe(folder, "from-euler --onto hero.glb", **recipe)
    assert "1 file: 1 made" in call("run").err
    assert "1 file: 1 cached" in call("run").err
    (folder / "hero.glb").write_bytes(call("retime", "noop.glb", "--speed", "2").product())
    assert "1 file: 1 made" in call("run").err
    (folder / "gltf-anim.toml").unlink()
    write_recipe(folder, "from-euler --onto hero.glb --name walk", **recipe)
    assert "1 file: 1 made" in call("run").err
    assert (
        json.loads(call("inspect", "build/walk.glb", "--format", "json").text)["files"][0]["clips"][-1]["name"]
        == "walk"
    )


def test_buffers_of_an_input_count_for_the_cache(folder: Path, call: Call) -> None:
    call("convert", "crowd/arm 1.glb", "crowd/arm.gltf").product()
    write_recipe(folder, *PLAIN, match="crowd/*.gltf", out="build/{stem}.gltf")
    assert "1 file: 1 made" in call("run").err
    assert "1 file: 1 cached" in call("run").err
    (buffer,) = (folder / "crowd").glob("*.bin")
    data = bytearray(buffer.read_bytes())
    data[-1] ^= 1
    buffer.write_bytes(data)
    assert "1 file: 1 made" in call("run").err
    assert call("convert", "build/arm.gltf").product() == call("resample", "crowd/arm.gltf", "--fps", "12").product()


def test_warnings_of_steps_are_shown_and_other_lines_with_verbose(folder: Path, call: Call) -> None:
    write_crowd(folder, arm="arm")
    (folder / "crowd/arm 1.glb").unlink()
    write_recipe(folder, "optimize --max-error 1")
    quiet = call("run", "-q", "--no-cache")
    assert quiet.err == "crowd/arm.glb: warning: --max-error 1 means 1 m, for want of a unit (0.5mm, 0.1%)\n"
    assert "crowd/arm.glb  " in call("run", "-v", "--no-cache").err


def test_outputs_are_never_inputs(folder: Path, call: Call) -> None:
    write_recipe(folder, *PLAIN, match="**/*.glb", out="{folder}/{stem}.small.glb")
    assert "2 files: 2 made" in call("run").err
    assert "2 files: 2 cached" in call("run").err
    (folder / "gltf-anim.toml").unlink()
    write_recipe(folder, *PLAIN, match="crowd/**", out="crowd/build/{name}")
    call("run").product()
    (folder / "crowd/arm 1.glb").unlink()
    (folder / "crowd/arm 1.small.glb").unlink()
    assert "no recipe matches a file" in call("run").err


def test_of_two_recipes_with_one_output_the_first_counts(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped")
    write_recipe(folder, "resample --fps 12", match="crowd/hero.glb", name="hero")
    write_recipe(folder, "resample --fps 4", name="crowd")
    write_recipe(folder, "resample --fps 2", out="far/{path}", name="far")
    assert "4 files: 4 made" in call("run").err
    made = {each: (folder / each / "crowd/hero.glb").read_bytes() for each in ("build", "far")}
    for each, fps in (("build", "12"), ("far", "2")):
        assert made[each] == call("resample", "crowd/hero.glb", "--fps", fps).product()
    assert "2 files: 2 cached" in call("run", "--recipe", "far").err
    assert "1 file: 1 made" in call("run", "noop.glb", "--recipe", "far").err  # which it does not match


def test_resume_reads_nothing_again_and_makes_what_is_missing(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped")
    (folder / "crowd/bad.glb").write_bytes(b"no glTF")
    write_recipe(folder, *PLAIN)
    call("run", "--no-cache")
    (folder / "crowd/bad.glb").write_bytes(built("arm"))
    (folder / "build/crowd/hero.glb").unlink()
    run = call("run", "--resume", "--no-cache")
    assert "3 files: 2 made, 1 done before" in run.err
    assert [entry["status"] for entry in journal(folder)].count("done before") == 1
    assert "3 files: 3 done before" in call("run", "--resume", "--no-cache").err
    assert "3 files: 3 made" in call("run", "--no-cache").err


def test_a_journal_that_was_cut_off_is_read(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped")
    write_recipe(folder, *PLAIN)
    call("run", "--no-cache", "--cache", "kept").product()
    path = folder / "kept/journal.jsonl"
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:2]) + lines[2][:30])
    assert "2 files: 1 made, 1 done before" in call("run", "--resume", "--no-cache", "--cache", "kept").err


def test_images_are_copied_beside_the_output(folder: Path, call: Call, tmp_path: Path) -> None:
    call("convert", "crowd/arm 1.glb", "crowd/arm.gltf").product()
    path = folder / "crowd/arm.gltf"
    document = json.loads(path.read_text())
    document["images"] = [{"uri": "skin.png"}]
    path.write_text(json.dumps(document))
    (folder / "crowd/skin.png").write_bytes(b"\x89PNG")
    write_recipe(folder, *PLAIN, match="crowd/*.gltf", out="build/{stem}.glb")
    copied = "note: 1 image copied beside the output (skin.png)"
    for status in ("made", "cached"):
        run = call("run")
        assert f"1 file: 1 {status}" in run.err
        assert copied in run.err
        assert copied not in call("run").err
        assert (folder / "build/skin.png").read_bytes() == b"\x89PNG"
        shutil.rmtree(folder / "build")


def test_the_cache_is_ignored_by_git(folder: Path, call: Call) -> None:
    write_recipe(folder, *PLAIN)
    call("run").product()
    assert (folder / ".gltf-anim-cache/.gitignore").read_text() == "*\n"


def test_a_terminal_shows_the_file_that_was_done(folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    write_crowd(folder, hero="biped")
    write_recipe(folder, *PLAIN)
    monkeypatch.setattr("cli.progress.DELAY_S", 0)
    monkeypatch.setattr("cli.progress.UPDATE_INTERVAL_S", 0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    err = call("run", "--jobs", "1").err
    assert "\r1 of 2, crowd/arm 1.glb ███" in err
    assert err.endswith(" s\n")


def test_steps_show_no_progress_of_their_own(folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    write_recipe(folder, "optimize")
    monkeypatch.setattr("cli.progress.DELAY_S", 0)
    monkeypatch.setattr("cli.progress.UPDATE_INTERVAL_S", 0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert "optimize █" not in (err := call("run").err)
    assert "\r1 of 1, crowd/arm 1.glb █" in err


def test_a_file_is_listed_with_the_error_of_each_step(folder: Path, call: Call) -> None:
    steps = "resample --fps 3", "convert", "optimize --max-error 5%"
    write_crowd(folder, hero="biped")
    write_recipe(folder, *steps, match="crowd/hero.glb")
    data, stated = (folder / "crowd/hero.glb").read_bytes(), []
    for line in steps:
        done = call(*line.split(), stdin=data)
        data, found = done.product(), re.search(r"max [0-9.]+ \w+ \([0-9.]+ %\)", done.err)
        stated += [f"{line.split()[0]} {found[0]}"] if found else []
    assert len(stated) == 2
    expected = ", ".join(stated)
    assert f" %), {expected}, took " in call("run").err
    (folder / "build/crowd/hero.glb").unlink()
    assert f" %), {expected} (cached)" in call("run", "-v").err
    assert f" %), {expected} (cached)" in call("run", "-v").err  # the output is there already


def test_without_a_cache_its_folder_need_not_be_writable(folder: Path, call: Call) -> None:
    """The journal serves --resume and --delete-stale alone."""
    write_recipe(folder, *PLAIN)
    (folder / ".gltf-anim-cache").write_text("in the way")
    assert "can't be written" in call("run").err
    run = call("run", "--no-cache")
    assert (run.code, "1 file: 1 made" in run.err) == (0, True), run.err
    assert run.err.startswith("note: --resume and --delete-stale will not know of this run: ")
    assert [path.name for path in (folder / "build").rglob("*.glb")] == ["arm 1.glb"]
    for option in ("--resume", "--delete-stale"):
        assert "can't be written" in refusal(call("run", "--no-cache", option), 3)
