"""Where the files of a run really are: a link must lead no output to an input, nor out of the folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from anim.errors import FormatError, OutputError

if TYPE_CHECKING:  # which imports this module
    from cli.workflows.run.job import Job


def clashes(jobs: Sequence[Job]) -> Iterator[str]:
    """Yield the problems of outputs that links lead elsewhere: to an input, to another output, or out of the folder.

    Names alone don't show it: with a link `build` to ".", "build/a.glb" is "a.glb".
    """
    folder_of = cache(os.path.realpath)  # many files have few folders
    read = {_real(job.folder / name, folder_of): name for job in jobs for name in _inputs(job)}
    made = dict[str, str]()
    for job in jobs:
        real = _real(job.folder / job.output, folder_of)
        if problem := _problem(job, real, _real(job.folder / job.input, folder_of), folder_of(job.folder)):
            yield problem
        elif real in read:
            yield f"'{job.output}', the output of '{job.input}', is the input '{read[real]}'"
        elif made.setdefault(real, job.output) != job.output:
            yield f"'{job.output}' and '{made[real]}' are the same output"


def check_output(job: Job) -> None:
    """Raise OutputError if the output isn't where a job may write; asked again before writing: links may be new."""
    real, own, folder = (os.path.realpath(job.folder / name) for name in (job.output, job.input, ""))
    if problem := _problem(job, real, own, folder):
        raise OutputError(problem)


def check_regular(folder: Path, names: Iterable[str]) -> None:
    """Raise FormatError for a pipe or device among the inputs: one that never ends would be read for its hash."""
    for name in names:
        if is_special(folder / name):
            raise FormatError("is no regular file", where=name)


def is_special(path: str | Path) -> bool:
    """Return whether there is something at a path that is neither a file nor a folder: a pipe or a device."""
    return not os.path.isfile(path) and os.path.exists(path) and not os.path.isdir(path)


def _inputs(job: Job) -> Iterator[str]:
    yield job.input
    for step in job.steps:
        yield from step.files


def _problem(job: Job, real: str, own: str, folder: str) -> str:
    """What is wrong with an output; real, own: output and input without links."""
    if real == own:
        return f"'{job.input}' is its own output ('{job.output}' is a link to it, or below one)"
    if not Path(real).is_relative_to(folder):
        return f"'{job.output}' leads out of the folder of the settings, by a link"
    return f"'{job.output}' is no regular file" if is_special(real) else ""


def _real(path: Path, folder_of: Callable[[str | Path], str]) -> str:
    """The path without links."""
    return os.path.realpath(path) if os.path.islink(path) else os.path.join(folder_of(path.parent), path.name)
