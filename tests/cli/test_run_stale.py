"""Outputs of deleted inputs, and the size of the cache."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import help_line, refusal
from tests.cli.running_recipes import PLAIN, built_files, run_with_a_deleted_input, statuses, write_crowd, write_recipe


@pytest.fixture
def made(folder: Path, call: Call) -> Path:
    return run_with_a_deleted_input(folder, call)


def test_outputs_of_deleted_inputs_are_named_and_deleted(made: Path, call: Call) -> None:
    note = "note: no recipe makes 1 output of earlier runs any more (build/crowd/cube.glb): "
    for _ in range(2):
        assert f"{note}--delete-stale deletes them\n" in call("run").err
    assert built_files(made) == {"build/crowd/hero.glb", "build/crowd/cube.glb"}
    assert f"{note}deleted\n" in call("run", "--delete-stale").err
    assert built_files(made) == {"build/crowd/hero.glb"}
    assert "note" not in call("run", "--delete-stale").err


def test_outputs_are_named_and_deleted_after_all_inputs_are_gone(made: Path, call: Call) -> None:
    (made / "crowd/hero.glb").unlink()
    run = call("run")
    assert run.code == 3
    assert "no recipe makes 2 outputs of earlier runs" in run.err
    assert "no recipe matches a file" in run.err
    assert call("run", "--delete-stale").code == 3
    assert built_files(made) == set()
    assert "note" not in call("run").err


def test_a_mistyped_pattern_deletes_nothing(made: Path, call: Call) -> None:
    settings = made / "gltf-anim.toml"
    settings.write_text(settings.read_text().replace("*.glb", "*.gbl"))
    before = built_files(made)
    run = call("run", "--delete-stale")
    assert run.code == 3
    assert "not deleted, since their inputs are still there" in run.err
    assert built_files(made) == before


def test_outputs_of_settings_that_were_renamed_are_stale(made: Path, call: Call) -> None:
    write_crowd(made, cube="morph_cube")
    call("run").product()
    (made / "gltf-anim.toml").rename(made / "anim.toml")
    (made / "crowd/cube.glb").unlink()
    assert "(build/crowd/cube.glb): deleted" in call("run", "--config", "anim.toml", "--delete-stale").err


def test_the_record_has_outputs_as_the_last_run_wrote_them(made: Path, call: Call) -> None:
    """Also after a run that was ended before it could save them, and with outputs that are deleted."""
    write_crowd(made, cube="morph_cube")
    call("run").product()
    record = made / ".gltf-anim-cache/outputs.json"
    record.unlink()
    write_crowd(made, hero="arm")
    (made / "crowd/cube.glb").unlink()
    assert "deleted" in call("run", "--delete-stale").err
    ((name, (_, (size, _), *_)),) = json.loads(record.read_text())["folders"][str(made)].items()
    assert (name, size) == ("build/crowd/hero.glb", (made / name).stat().st_size)


@pytest.mark.parametrize("is_saved", [True, False])
def test_outputs_of_other_settings_in_the_folder_are_not_stale(is_saved: bool, made: Path, call: Call) -> None:
    """Nor are they inputs of their own recipe. It deleted them, and two settings deleted each other's outputs."""
    call("run", "--delete-stale").product()
    text = (made / "gltf-anim.toml").read_text()
    (made / "small.toml").write_text(text.replace("build/", "small/"))
    if not is_saved:
        (made / ".gltf-anim-cache/outputs.json").unlink()
    assert "note" not in call("run", "--config", "small.toml", "--delete-stale").err
    assert "note" not in call("run", "--delete-stale").err
    assert built_files(made) == {"build/crowd/hero.glb"}
    assert (made / "small/crowd/hero.glb").exists()
    write_crowd(made, cube="morph_cube")
    call("run", "--config", "small.toml").product()
    (made / "crowd/cube.glb").unlink()
    assert "(small/crowd/cube.glb): deleted" in call("run", "--config", "small.toml", "--delete-stale").err


def test_only_unchanged_outputs_of_earlier_runs_are_deleted(made: Path, call: Call) -> None:
    (made / "build/crowd/cube.glb").write_bytes(b"other")
    (made / "build/notes.glb").write_bytes(b"mine")
    call("run", "--delete-stale")
    assert built_files(made) == {"build/crowd/hero.glb", "build/crowd/cube.glb", "build/notes.glb"}


def test_outputs_that_were_edited_are_named_and_stay(made: Path, call: Call) -> None:
    """Nothing was said of them."""
    (made / "build/crowd/cube.glb").write_bytes(b"other")
    assert "cube.glb" not in call("run").err
    note = "note: no recipe makes 1 output that changed after its run (build/crowd/cube.glb): not deleted\n"
    for _ in range(2):
        assert note in call("run", "--delete-stale").err
    (made / "build/crowd/cube.glb").unlink()
    assert "note" not in call("run", "--delete-stale").err


def test_a_run_of_some_files_deletes_nothing(made: Path, call: Call) -> None:
    assert "note" not in call("run", "crowd/hero.glb").err
    run = call("run", "crowd/hero.glb", "--delete-stale")
    assert "--delete-stale needs a run of all files and recipes" in refusal(run, 2)
    assert help_line(run) == "leave out FILE and --recipe"
    assert "build/crowd/cube.glb" in call("run").err


def test_buffers_and_empty_folders_are_deleted_too(made: Path, call: Call) -> None:
    write_crowd(made, cube="morph_cube")
    (made / "gltf-anim.toml").unlink()
    write_recipe(made, *PLAIN, out="build/{stem}/{stem}.gltf")
    assert "no recipe makes 2 outputs" in call("run", "--delete-stale").err
    assert built_files(made) == {f"build/{name}/{name}.{end}" for name in ("hero", "cube") for end in ("gltf", "bin")}
    (made / "crowd/cube.glb").unlink()
    call("run", "--delete-stale")
    assert [path.name for path in (made / "build").iterdir()] == ["hero"]


@pytest.mark.parametrize(
    ("link", "target", "match"),
    [
        ("build", "models", "models/crowd/*.glb"),
        ("models", "build", "models/crowd/*.glb"),
        ("cube.glb", "build/crowd/cube.glb", "cube.glb"),
    ],
)
def test_outputs_that_a_recipe_reads_by_another_name_are_not_deleted(
    link: str, target: str, match: str, made: Path, call: Call
) -> None:
    """The input was deleted, with exit 0."""
    if link == "build":
        (made / "build").rename(made / target)
    (made / link).symlink_to(target)
    (made / "gltf-anim.toml").unlink()
    write_recipe(made, *PLAIN, match=match, out="small/{path}")
    call("run", "--delete-stale").product()
    assert (made / "build/crowd/cube.glb").exists()


@pytest.mark.parametrize("against", ["build/crowd/cube.glb", "build/crowd/{stem}e.glb"])
def test_outputs_that_a_step_or_budget_names_are_not_deleted(against: str, made: Path, call: Call) -> None:
    """The next run was exit 3: a recipe of a step's file was taken away."""
    (made / "gltf-anim.toml").unlink()
    (made / "crowd/hero.glb").rename(made / "crowd/cub.glb")
    write_recipe(made, *PLAIN)
    if "{" in against:
        budget = f'[[budget]]\nmatch = "build/**"\nerror = "1m"\nagainst = "{against}"\n'
        (made / "gltf-anim.toml").write_text((made / "gltf-anim.toml").read_text() + budget)
    else:
        write_recipe(made, f"from-euler --onto {against}", match="*.bvh", out="clips/{stem}.glb")
    assert "(build/crowd/hero.glb): deleted" in call("run", "--delete-stale").err
    assert built_files(made) == {"build/crowd/cub.glb", "build/crowd/cube.glb"}


def test_shared_buffers_are_not_deleted(made: Path, call: Call) -> None:
    """The copy was broken, and buffers named by their content remained."""
    write_crowd(made, cube="morph_cube")
    (made / "gltf-anim.toml").unlink()
    write_recipe(made, *PLAIN, out="build/{stem}.gltf")
    call("run", "--delete-stale").product()
    shutil.copy(made / "build/cube.gltf", made / "build/keep.gltf")
    (made / "build/hero.bin").rename(made / "build/taken")
    (made / "build/hero.bin").write_bytes(b"other")
    (made / "build/hero.gltf").unlink()
    call("run").product()
    (by_content,) = (made / "build").glob("hero-*.bin")
    shutil.rmtree(made / "crowd")
    assert "no recipe makes 2 outputs" in call("run", "--delete-stale").err
    assert built_files(made) == {f"build/{name}" for name in ("keep.gltf", "cube.bin", "hero.bin", "taken")}
    assert not by_content.exists()


def test_buffers_of_inputs_are_not_deleted(made: Path, call: Call) -> None:
    """They were, where the input is more than one folder above."""
    write_crowd(made, cube="morph_cube")
    (made / "gltf-anim.toml").unlink()
    write_recipe(made, *PLAIN, out="build/far/{stem}.gltf")
    call("run", "--delete-stale").product()
    text = (made / "build/far/cube.gltf").read_text()
    (made / "top.gltf").write_text(text.replace("cube.bin", "build/far/cube.bin"))
    write_recipe(made, *PLAIN, match="*.gltf", out="small/{path}")
    (made / "crowd/cube.glb").unlink()
    assert "(build/far/cube.gltf): deleted" in call("run", "--delete-stale").err
    assert built_files(made) == {"build/far/cube.bin", "build/far/hero.gltf", "build/far/hero.bin"}


def test_outputs_beside_their_inputs_are_no_inputs_when_these_are_deleted(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped", cube="morph_cube")
    (folder / "crowd/arm 1.glb").unlink()
    write_recipe(folder, *PLAIN, match="crowd/*.glb", out="crowd/{stem}-small.glb")
    call("run").product()
    (folder / "crowd/cube.glb").unlink()
    assert "(crowd/cube-small.glb)" in call("run").err
    assert statuses(folder).keys() == {"crowd/hero.glb"}
    (folder / "gltf-anim.toml").unlink()  # another recipe may have them as inputs
    write_recipe(folder, *PLAIN, match="crowd/*-small.glb")
    assert "note" not in call("run", "--delete-stale").err
    assert built_files(folder) == {"build/crowd/hero-small.glb", "build/crowd/cube-small.glb"}


def test_results_that_were_not_used_for_longest_leave_the_cache(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped", cube="morph_cube")
    write_recipe(folder, *PLAIN)
    call("run", "crowd/hero.glb").product()
    call("run", "crowd/cube.glb").product()
    call("run", "crowd/hero.glb").product()  # used last
    kept = sum(
        len(call("resample", f"crowd/{name}.glb", *PLAIN[0].split()[1:]).product()) for name in ("hero", "arm 1")
    )
    run = call("run", "crowd/arm 1.glb", "--cache-size", str(kept))
    assert "note: 1 result (" in run.err
    assert "deleted from the cache: see --cache-size" in run.err
    shutil.rmtree(folder / "build")
    call("run").product()
    assert statuses(folder) == {"crowd/arm 1.glb": "cached", "crowd/cube.glb": "made", "crowd/hero.glb": "cached"}
    objects = [path for path in (folder / ".gltf-anim-cache/objects").rglob("*") if path.is_file()]
    records = [path for path in (folder / ".gltf-anim-cache/results").rglob("*") if path.is_file()]
    assert len(objects) == len(records) == 3
