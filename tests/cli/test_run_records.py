"""Records of outputs and the journal of `run`, where a run is ended, fails at its end, or isn't alone."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from cli.workflows.run import own_files
from cli.workflows.run import run as runs
from cli.workflows.run.job import Job, JobResult
from cli.workflows.run.run_job import run_job
from tests.cli.conftest import Call
from tests.cli.running import built, refusal
from tests.cli.running_recipes import statuses, write_crowd, write_recipe

PLAIN = "resample --fps 12"
CACHE = ".gltf-anim-cache"


def recorded(folder: Path) -> set[str]:
    """Outputs in the record."""
    return set(json.loads((folder / CACHE / "outputs.json").read_text())["folders"][str(folder)])


@pytest.fixture
def ended(folder: Path, call: Call) -> Path:
    """A folder with a run that was ended before it could save its outputs, of which one input is deleted since."""
    write_crowd(folder, hero="biped")
    write_recipe(folder, PLAIN, match="crowd/*.glb", out="crowd/{stem}.small.glb")
    call("run").product()
    (folder / CACHE / "outputs.json").unlink()
    (folder / "crowd/arm 1.glb").unlink()
    return folder


@pytest.mark.parametrize("args", [(), ("--resume",), ("crowd/hero.glb",)])
def test_outputs_of_a_run_that_was_ended_are_found(args: tuple[str, ...], ended: Path, call: Call) -> None:
    call("run", *args).product()
    call("run").product()  # which begins a new journal
    assert recorded(ended) == {"crowd/hero.small.glb", "crowd/arm 1.small.glb"}
    assert "note: no recipe makes 1 output of earlier runs any more" in call("run", "--delete-stale").err
    assert sorted(path.name for path in (ended / "crowd").iterdir()) == ["hero.glb", "hero.small.glb"]


def test_outputs_of_a_run_that_was_ended_are_found_without_any_input(ended: Path, call: Call) -> None:
    (ended / "crowd/hero.glb").unlink()
    assert call("run", "--delete-stale").code == 3
    assert not (ended / "crowd").exists()


def test_what_was_changed_after_a_run_that_was_ended_is_no_output_of_it(ended: Path, call: Call) -> None:
    (ended / "crowd/arm 1.small.glb").write_bytes((ended / "noop.glb").read_bytes())
    assert "2 files: 1 made, 1 cached" in call("run", "--delete-stale").err
    assert statuses(ended)["crowd/arm 1.small.glb"] == "made"


@pytest.fixture
def two_recipes(folder: Path) -> Path:
    """A folder with two recipes, each for one file."""
    write_crowd(folder, hero="biped")
    write_recipe(folder, PLAIN, match="crowd/arm 1.glb", name="arm")
    write_recipe(folder, PLAIN, match="crowd/hero.glb", name="hero")
    return folder


def test_two_runs_at_once_keep_the_outputs_and_lines_of_both(
    two_recipes: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    others = ["hero"]

    def run_another_first(job: Job) -> JobResult:
        if others:
            call("run", "--recipe", others.pop()).product()
        return run_job(job)

    monkeypatch.setattr(runs, "run_job", run_another_first)
    call("run", "--recipe", "arm").product()
    assert recorded(two_recipes) == {"build/crowd/arm 1.glb", "build/crowd/hero.glb"}
    if sys.platform != "win32":  # which has no locks
        assert statuses(two_recipes) == {"crowd/arm 1.glb": "made", "crowd/hero.glb": "made"}
    assert "2 files: 2 done before" in call("run", "--resume").err
    call("run", "--recipe", "arm").product()
    assert statuses(two_recipes) == {"crowd/arm 1.glb": "cached"}


def test_what_is_edited_while_others_are_made_is_no_output(
    two_recipes: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its stamp at the end of the run was recorded as that of the output, which --delete-stale deleted."""
    output, edited = two_recipes / "build/crowd/arm 1.glb", built("morph_cube")

    def edit_the_first(job: Job) -> JobResult:
        if job.input == "crowd/hero.glb":
            output.write_bytes(edited)
        return run_job(job)

    monkeypatch.setattr(runs, "run_jobs", lambda jobs, *others: ((job, edit_the_first(job)) for job in jobs))
    call("run").product()
    (two_recipes / "crowd/arm 1.glb").unlink()
    assert "that changed after its run (build/crowd/arm 1.glb): not deleted" in call("run", "--delete-stale").err
    assert output.read_bytes() == edited


def test_what_is_edited_before_its_worker_is_heard_is_no_output(
    two_recipes: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its stamp when the result came, as after a long look at other files, was recorded as that of the output."""

    def edit(job: Job) -> JobResult:
        result = run_job(job)
        (two_recipes / job.output).write_bytes(built("morph_cube"))
        return result

    monkeypatch.setattr(runs, "run_jobs", lambda jobs, *others: ((job, edit(job)) for job in jobs))
    call("run").product()
    (two_recipes / "crowd/arm 1.glb").unlink()
    assert "that changed after its run (build/crowd/arm 1.glb): not deleted" in call("run", "--delete-stale").err


@pytest.mark.parametrize("is_ended", [False, True])
def test_an_output_with_an_edited_buffer_stays(is_ended: bool, folder: Path, call: Call) -> None:
    """Only its .gltf was compared, and the edited .bin was deleted with it."""
    write_crowd(folder, hero="biped")
    write_recipe(folder, PLAIN, match="crowd/*.glb", out="build/{stem}.gltf")
    call("run").product()
    if is_ended:
        (folder / CACHE / "outputs.json").unlink()
    for name in ("arm 1", "hero"):
        (folder / f"crowd/{name}.glb").unlink()
    (folder / "build/hero.bin").write_bytes(b"edited")
    call("run", "--delete-stale")
    assert {path.name for path in (folder / "build").iterdir()} == {"hero.bin", "hero.gltf"}


def test_an_output_that_another_run_writes_again_is_its_output(
    two_recipes: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    output, others = two_recipes / "build/crowd/arm 1.glb", ["arm"]

    def write_the_first_again(job: Job) -> JobResult:
        if job.input == "crowd/hero.glb" and others:
            output.unlink()
            call("run", "--recipe", others.pop()).product()
        return run_job(job)

    monkeypatch.setattr(runs, "run_jobs", lambda jobs, *others: ((job, write_the_first_again(job)) for job in jobs))
    call("run").product()
    (two_recipes / "crowd/arm 1.glb").unlink()
    assert "(build/crowd/arm 1.glb): deleted" in call("run", "--delete-stale").err


def test_outputs_are_recorded_before_stale_ones_are_deleted(
    two_recipes: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    call("run").product()
    (two_recipes / "crowd/arm 1.glb").rename(two_recipes / "crowd/arm 2.glb")
    write_recipe(two_recipes, PLAIN, match="crowd/arm 2.glb", out="other/{name}")
    output = two_recipes / "build/crowd/arm 1.glb"
    unlink = Path.unlink

    def refuse(path: Path, missing_ok: bool = False) -> None:
        if path == output:
            raise PermissionError(13, "Permission denied")
        unlink(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", refuse)
    run = call("run", "--delete-stale")
    assert "arm 1.glb: can't be written (permission denied)" in run.err
    assert recorded(two_recipes) == {"build/crowd/arm 1.glb", "build/crowd/hero.glb", "other/arm 2.glb"}


def test_lines_are_appended_to_what_another_writes(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    with own_files.open_for_lines(path, append=False) as first:
        with own_files.open_for_lines(path, append=False) as second:
            for file, line in ((first, b"a\n"), (second, b"b\n"), (first, b"c\n")):
                file.write(line)
        assert path.read_bytes() == (b"a\nb\nc\n" if sys.platform != "win32" else path.read_bytes())
    with own_files.open_for_lines(path, append=False):
        assert path.read_bytes() == b""


@pytest.mark.parametrize("tag", ["", "Signature: 8a477f597d28d172789f06886806bc55\n# of another program\n"])
def test_a_folder_with_other_files_is_no_cache(tag: str, folder: Path, call: Call) -> None:
    write_recipe(folder, PLAIN)
    mine = folder / "outputs.json"
    mine.write_text("mine")
    if tag:
        (folder / "CACHEDIR.TAG").write_text(tag)
    run = call("run", "--cache", ".")
    assert refusal(run, 2) == f"gltf-anim: --cache: '{folder}' has other files (expected a new folder, or a cache)"
    assert (mine.read_text(), (folder / ".gitignore").exists()) == ("mine", False)


def test_a_new_folder_and_a_cache_may_be_named(folder: Path, call: Call) -> None:
    write_recipe(folder, PLAIN)
    (folder / "kept").mkdir()
    (folder / "kept/.gitkeep").touch()
    for words in ("1 made", "1 cached"):
        assert words in call("run", "--cache", "kept").err
