"""`gltf-anim run`: recipes of the settings over many files."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from anim.errors import OutputError
from anim.units import plural
from cli import errors, units
from cli.errors import NoFileError, UsageError
from cli.io import documents
from cli.options import common
from cli.text import Reporter, format_bytes
from cli.workflows.run import cache as caching
from cli.workflows.run import journal as journals
from cli.workflows.run import outputs, own_files
from cli.workflows.run.budgets import has_budget
from cli.workflows.run.cluster import connect_cluster
from cli.workflows.run.emit import SCRIPTS, readable_jobs
from cli.workflows.run.job import Job
from cli.workflows.run.plan import explain_unused, plan_jobs
from cli.workflows.run.prune import prune
from cli.workflows.run.recipe import Recipe, RecipeBook, chosen_recipes, read_recipes
from cli.workflows.run.run import RecipeRun
from cli.workflows.run.stale import report_stale

Script = StrEnum("Script", [(name, name) for name in SCRIPTS])  # type: ignore[misc]


def command(
    inputs: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FILE]...",
            help="Files, folders, or patterns; without any, all that the recipes match.",
            show_default=False,
        ),
    ] = None,
    *,
    recipe: Annotated[
        list[str] | None, typer.Option("--recipe", metavar="NAME", help="Only this recipe; may be repeated.")
    ] = None,
    config: Annotated[
        str | None, typer.Option("--config", metavar="FILE", help="Settings, instead of the nearest gltf-anim.toml.")
    ] = None,
    jobs: Annotated[
        int, typer.Option("--jobs", "-j", metavar="N", min=0, help="Number of processes; 0: one per core.")
    ] = 0,
    cache: Annotated[
        str | None,
        typer.Option(
            "--cache",
            metavar="DIR",
            help=f"Folder of results and journal.  [default: {caching.NAME} beside the settings]",
        ),
    ] = None,
    no_cache: Annotated[
        bool,
        typer.Option(
            "--no-cache", help="Keep no results, and use none; where no journal can be written, the run has none."
        ),
    ] = False,
    cache_size: Annotated[
        str,
        typer.Option(
            "--cache-size", metavar="SIZE", help="Maximum size of all results; those not used for longest are deleted."
        ),
    ] = "5GB",
    delete_stale: Annotated[
        bool,
        typer.Option("--delete-stale", help="Delete unchanged outputs of earlier runs that no recipe makes any more."),
    ] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the last run: what it made is not even read again.")
    ] = False,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="Use the workers of a dask scheduler: tcp://host:8786."),
    ] = None,
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Then check the outputs by the rules and budgets of the settings: exit 6 on errors."
        ),
    ] = False,
    emit: Annotated[
        Script | None,
        typer.Option("--emit", help="Only print a script of single commands.", show_default=False),
    ] = None,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> int:
    """Run recipes over many files: steps in one process, cached by content, on all cores.

    A recipe is in gltf-anim.toml, or in [tool.gltf-anim] of pyproject.toml. Its steps are command lines without files:
    commands that make glTF from glTF; from-euler can be the first.

    \b
        [[recipe]]
        name = "crowd"
        match = "crowd/**/*.glb"
        steps = ["resample --fps 30", "optimize --max-error 0.5mm"]
        out = "build/{path}"

    match, out and files named in steps are relative to the folder of the settings. out takes {path}, {folder}, {name}
    and {stem} (the name without extension). For two recipes with the same output the first counts. Outputs are no
    inputs of recipes, but steps may name them: these are made first.

    Results are kept by the content of the input and of the files that steps name, by the steps, and by the version of
    this tool: a second run makes nothing again. --resume continues a run that was interrupted, by its journal.
    Files that fail are named with their step, others are done; the exit code is the largest one. An older output of a
    file that fails stays. A file without the clip or node that a step selects fails: a recipe of its own, above, can
    leave that step out. Budgets are checked with --check only.

    A note names outputs of earlier runs that no recipe makes any more, as after an input was deleted. --delete-stale
    deletes them, unless they were changed since.

    --scheduler needs the extra `cluster`; workers see the files under the same names. Slurm and others start dask's
    workers (dask-jobqueue). --emit prints what make, ninja or a shell can run instead, in the folder of the settings.
    """
    reporter, limit = Reporter(quiet, verbose), units.parse_size(cache_size, "--cache-size")
    if delete_stale and (inputs or recipe):
        raise UsageError("--delete-stale needs a run of all files and recipes", help="leave out FILE and --recipe")
    book = read_recipes(config)
    folder = _cache_folder(book.folder, cache)
    last = journals.read_journal(folder / journals.NAME)
    record = outputs.read_outputs(folder / outputs.NAME, book.path, last)
    is_all, chosen = not (inputs or recipe), chosen_recipes(book, recipe or ())
    try:
        planned = plan_jobs(book, chosen, inputs or (), record, named=bool(recipe))
    except NoFileError:  # as after all inputs were deleted
        _warn_of_unused(book, chosen, (), record, reporter)
        if is_all and emit is None:
            with _tolerate_unwritable(no_cache and not delete_stale, reporter):
                report_stale(record, book, (), outputs.WrittenFiles(), reporter, delete=delete_stale)
        raise
    if not inputs:
        _warn_of_unused(book, chosen, planned, record, reporter)
    if emit is not None:
        readable, code = readable_jobs(planned)
        if readable:
            script = SCRIPTS[emit.value](readable)
            documents.write_text(script.encode(errors="surrogateescape"))  # bytes of names that are not UTF-8
        return code
    results = caching.ResultCache(folder)
    processes = jobs or os.cpu_count() or 1
    with ExitStack() as stack:
        cluster = None if scheduler is None else stack.enter_context(connect_cluster(scheduler))
        path, settings = folder / journals.NAME, book.path.name
        journal = journals.Journal(path, None, settings, {})  # unless one can be written
        with _tolerate_unwritable(no_cache and not (resume or delete_stale), reporter):
            results.prepare()
            record.save_unsaved()  # before a new journal is begun
            journal = stack.enter_context(journals.open_journal(path, settings, len(planned), last, resume=resume))
        run = RecipeRun(planned, journal, None if no_cache else results, reporter, processes, cluster)
        code = run.run()
    if not no_cache and run.counts[journals.MADE]:
        _prune(results, limit, reporter)
    if journal.file is not None:
        if is_all:
            report_stale(record, book, run.jobs, run.written, reporter, delete=delete_stale)
        else:
            record.save(run.written)
    if check:
        written = [os.path.relpath(book.folder / each) for each in run.written.inputs]
        return max(code, _check(written, config, quiet=quiet))
    if has_budget(book, run.written.inputs):
        reporter.info(f"note: the budgets of {book.path.name} were not checked: `run --check` or `check` does that")
    return code


@contextmanager
def _tolerate_unwritable(tolerated: bool, reporter: Reporter) -> Iterator[None]:
    """Note that the journal and the record of outputs can't be written, instead of ending the run."""
    try:
        yield
    except OutputError as error:
        if not tolerated:
            raise
        reporter.info(f"note: --resume and --delete-stale will not know of this run: {error}")


def _cache_folder(settings: Path, named: str | None) -> Path:
    """Folder of results and journal. Only a name of the user's own may be a link: another may have come with files."""
    if named is not None:
        folder = Path(named).resolve()
        caching.check_named(folder)
        return folder
    own_files.check_links(settings, settings / caching.NAME)
    return settings / caching.NAME


def _warn_of_unused(
    book: RecipeBook, chosen: Sequence[Recipe], jobs: Sequence[Job], record: outputs.OutputRecord, reporter: Reporter
) -> None:
    for line in explain_unused(book, chosen, jobs, record):
        reporter.warn(line)


def _prune(results: caching.ResultCache, limit: int, reporter: Reporter) -> None:
    count, size = prune(results, limit)
    if count:
        reporter.info(
            f"note: {plural(count, 'result')} ({format_bytes(size)}) deleted from the cache: see --cache-size"
        )


def _check(outputs: Sequence[str], config: str | None, *, quiet: bool) -> int:
    """Check files by the settings; the exit code. config: named settings, None for the nearest of each file."""
    from cli.commands import check

    if not outputs:
        return errors.DONE
    return errors.run_guarded(lambda: check.command(list(outputs), config=config, quiet=quiet))
