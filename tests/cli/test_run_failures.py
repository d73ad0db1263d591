"""`run`: files that fail, what is said of their steps and outputs."""

from __future__ import annotations

from pathlib import Path

import pytest

from anim.errors import FormatError
from tests.cli.conftest import Call
from tests.cli.running_recipes import PLAIN, journal, statuses, write_crowd, write_recipe


def test_a_file_that_fails_is_named_and_the_rest_is_done(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped")
    (folder / "crowd/bad.glb").write_bytes(b"no glTF")
    write_recipe(folder, *PLAIN)
    run = call("run")
    assert run.code == 3
    assert "gltf-anim: crowd/bad.glb: is no glTF" in run.err
    assert "build/crowd/bad.glb  not written: step 1 of 1 (resample --fps 12) failed on crowd/bad.glb" in run.err
    assert "3 files: 2 made, 1 failed" in run.err
    assert sorted(path.name for path in (folder / "build/crowd").iterdir()) == ["arm 1.glb", "hero.glb"]
    assert statuses(folder)["crowd/bad.glb"] == "failed"


def test_a_later_step_names_the_file_and_the_exit_code_is_the_largest(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped")
    (folder / "crowd/bad.glb").write_bytes(b"no glTF")
    write_recipe(folder, "resample --fps 12", "trim --to 0.5 --clip walk")
    run = call("run")
    assert run.code == 5
    assert "gltf-anim: crowd/arm 1.glb: " in run.err
    failed = "step 2 of 2 (trim --to 0.5 --clip walk) failed on crowd/arm 1.glb"
    assert f"build/crowd/arm 1.glb  not written: {failed}\n" in run.err
    assert "gltf-anim: crowd/arm 1.glb: no clip matches 'walk'\nhelp: the clips are 'twist', 'bend'\n" in run.err
    assert "help: files without the clip or node that a step selects need a recipe of their own" in run.err
    assert "keys" not in run.err  # the line of a step that was done would be about a file that is not written


def test_an_older_output_of_a_file_that_fails_stays_and_is_named(folder: Path, call: Call) -> None:
    write_crowd(folder)
    write_recipe(folder, "resample --fps 12", "optimize --max-error 1 --effort fast", "trim --to 0.5 --clip walk")
    (folder / "build/crowd").mkdir(parents=True)
    (folder / "build/crowd/arm 1.glb").write_bytes(b"older")
    run = call("run", "-v", "-q")
    assert (folder / "build/crowd/arm 1.glb").read_bytes() == b"older"
    lines = run.err.splitlines()
    assert lines[0].startswith("warning: --max-error 1 means 1 m")
    assert lines[1:] == [
        "gltf-anim: crowd/arm 1.glb: no clip matches 'walk'",
        "help: the clips are 'twist', 'bend'",
        "build/crowd/arm 1.glb  not written, an older one stays: "
        "step 3 of 3 (trim --to 0.5 --clip walk) failed on crowd/arm 1.glb",
    ]
    assert journal(folder)[0]["messages"][-1] == lines[-1]


def test_an_output_that_is_written_before_the_job_fails_is_said_to_be(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise FormatError("is gone")

    monkeypatch.setattr("cli.workflows.run.job._stamp_companions", fail)
    write_recipe(folder, *PLAIN)
    assert "build/crowd/arm 1.glb  failed, but was written meanwhile\n" in call("run").err


def test_files_without_a_clip_have_a_recipe_of_their_own(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped")
    write_recipe(folder, "resample --fps 12", match="crowd/arm*.glb")
    write_recipe(folder, "resample --fps 12", "trim --to 0.5 --clip 'wal*'")
    run = call("run")
    assert run.code == 0
    assert "2 files: 2 made" in run.err
    assert "help: " not in run.err
