"""Files of a run, with the recipe and the output of each."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath

from anim.files.special_files import is_device_or_pipe
from anim.gltf.io import container
from cli.errors import NoFileError, UsageError
from cli.io import input_files
from cli.io.path_patterns import can_match_below, matches
from cli.workflows.run import places
from cli.workflows.run.job import Job
from cli.workflows.run.order import group_jobs
from cli.workflows.run.outputs import OutputRecord
from cli.workflows.run.recipe import Recipe, RecipeBook
from cli.workflows.run.steps import EDITING


def plan_jobs(
    book: RecipeBook, recipes: Sequence[Recipe], files: Sequence[str], earlier: OutputRecord, *, named: bool
) -> list[Job]:
    """Return a job for each file and recipe that matches it, in order; for the same output the first recipe counts.

    files: paths, folders and patterns, from the working folder; empty for all files below the folder of the settings.
    earlier: outputs of earlier runs, which are not found as inputs of the recipes that made them.
    named: whether the recipes are named by the command line: then files need not match.
    Outputs are never inputs: "*.glb" would match those beside their inputs. Raises UsageError for two files with one
    output, NoFileError without any file, and FormatError for a folder that can't be read and may have matching files:
    their outputs are no stale ones.
    """
    given = [_relative(book, each) for each in input_files.expand(files)]
    jobs: dict[str, Job] = {}
    for recipe in recipes:
        for path in given or _files(book, recipe):
            if not (named and given) and not matches(path, recipe.match):
                continue
            if not given and earlier.is_product(path, book.recipes):
                continue
            job = Job(book.folder, path, recipe.output_of(path), recipe.steps)
            same = jobs.setdefault(job.output, job)
            if same.input != path:
                problem = f"'{same.input}' and '{path}' have the same output, '{job.output}'"
                raise UsageError(f"{book.path}: {problem}", help="out needs {path}, or {folder} with {name} or {stem}")
    chosen = [job for job in jobs.values() if job.input not in jobs or job.input == job.output]
    _check(book, chosen, given)
    try:
        return [job for group in group_jobs(chosen) for job in group]
    except UsageError as error:
        raise UsageError(f"{book.path}: {error}") from None


def explain_unused(
    book: RecipeBook, recipes: Sequence[Recipe], jobs: Sequence[Job], earlier: OutputRecord
) -> Iterator[str]:
    """Yield a line for each recipe that makes nothing since it matches only outputs of others, which are no inputs."""
    outputs = dict.fromkeys(job.output for job in jobs)
    for recipe in recipes:
        if any(job.steps is recipe.steps for job in jobs):
            continue
        others, own = [each for each in book.recipes if each is not recipe], _fixed_folder(recipe.out, "{")
        found = (name for name in {**outputs, **earlier.outputs} if matches(name, recipe.match))
        outside = (name for name in found if not own or not PurePosixPath(name).is_relative_to(own))
        name = next((each for each in outside if each in outputs or earlier.is_product(each, others)), "")
        if name and not any(matches(job.input, recipe.match) for job in jobs):
            problem = f"recipe '{recipe.name}' makes nothing: it matches only outputs of others ('{name}')"
            yield f"{problem}, which are no inputs: put all steps of a file into one recipe"


def _check(book: RecipeBook, jobs: Sequence[Job], given: Sequence[str]) -> None:
    for job in jobs:
        if job.input == job.output:
            raise UsageError(f"{book.path}: '{job.input}' is its own output (expected another name in out)")
        ending = PurePosixPath(job.output).suffix
        if ending.lower() not in container.SUFFIXES:
            expected = f"expected {' or '.join(container.SUFFIXES)}"
            raise UsageError(f"{book.path}: glTF is no '{ending}' ({expected}): the output of '{job.input}'")
    used = {job.input for job in jobs}
    for path in given:
        if path not in used:
            raise UsageError(f"{path}: matches no recipe of {book.path}", help="--recipe NAME chooses one for any file")
    if not jobs:
        raise NoFileError(f"{book.path}: no recipe matches a file")
    if problem := next(places.find_clashes(jobs), ""):
        raise UsageError(f"{book.path}: {problem}", help="out names other files, in the folder of the settings")
    places.check_regular(book.folder, used | {name for job in jobs for step in job.steps for name in step.files})


def _relative(book: RecipeBook, path: str) -> str:
    absolute = Path(os.path.abspath(path))
    if not absolute.is_relative_to(book.folder):
        raise UsageError(f"{path}: is outside of {book.folder}, the folder of the settings")
    return absolute.relative_to(book.folder).as_posix()


def _files(book: RecipeBook, recipe: Recipe) -> Iterator[str]:
    """Files below the folder that can match, without hidden ones and those of the output's own folder."""
    outputs = _fixed_folder(recipe.out, "{")
    is_gltf = recipe.steps[0].command[0] in EDITING
    for folder, folders, names in input_files.walk(book.folder / _fixed_folder(recipe.match, "*?[")):
        relative = Path(folder).relative_to(book.folder).as_posix()
        prefix = "" if relative == "." else f"{relative}/"
        visible = (each for each in folders if not each.startswith(".") and prefix + each != outputs)
        folders[:] = sorted(each for each in visible if can_match_below(prefix + each, recipe.match))
        for name in sorted(names):
            if name.startswith(".") or (is_gltf and not name.lower().endswith(container.SUFFIXES)):
                continue
            if not is_device_or_pipe(os.path.join(folder, name)):  # as `check` leaves pipes and devices out
                yield prefix + name


def _fixed_folder(pattern: str, wild: str) -> str:
    """The folders of a pattern before the first part with a wildcard: "crowd" of "crowd/**/*.glb"."""
    parts = pattern.split("/")[:-1]
    fixed = next((i for i, part in enumerate(parts) if any(c in part for c in wild)), len(parts))
    return "/".join(parts[:fixed])
