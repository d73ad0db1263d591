"""Real places of the files of a run: a link must lead no output to an input, nor out of the folder."""

from __future__ import annotations

import os
import posixpath
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from anim.errors import FormatError, OutputError
from anim.files.special_files import is_device_or_pipe
from cli.io.output_names import name_key, say_where_equal

RealPath: TypeAlias = Callable[[str], str]  # a path without links

if TYPE_CHECKING:  # which imports this module
    from cli.workflows.run.job import Job


def find_clashes(jobs: Sequence[Job]) -> Iterator[str]:
    """Yield the problems of outputs that are an input, another output, or out of the folder of the settings.

    Names alone don't show it: with a link `build` to ".", "build/a.glb" is "a.glb", and some file systems ignore case.
    A file of another job's steps may be an output by its name: one recipe makes what the next one reads.
    """
    real_of = _real_paths()
    outputs = {output_key(job.output) for job in jobs}
    names = dict.fromkeys((job.folder, job.input) for job in jobs)  # in order, for messages
    names |= dict.fromkeys(
        (job.folder, name) for job in jobs for name in _step_files(job) if output_key(name) not in outputs
    )
    read = {name_key(real_of(os.path.join(folder, name))): name for folder, name in names}
    made = dict[str, str]()
    for job in jobs:
        real = name_key(real_of(os.path.join(job.folder, job.output)))
        if problem := _problem(job, real_of, _step_files(job)):
            yield problem
        elif real in read:
            yield f"'{job.output}', the output of '{job.input}', is the input '{read[real]}'"
        elif (other := made.setdefault(real, job.output)) != job.output:
            yield f"'{job.output}' and '{other}' are the same output{say_where_equal(job.output, other)}"


def check_output(job: Job, read: Iterable[Path] = ()) -> None:
    """Raise OutputError if the output isn't where a job may write; asked again before writing: links may be new.

    read: files that its steps read, of which some are known by now only: the input's buffers.
    """
    if problem := _problem(job, os.path.realpath, [*_step_files(job), *map(str, read)]):
        raise OutputError(problem)


def check_regular(folder: Path, names: Iterable[str]) -> None:
    """Raise FormatError for a pipe or device among the inputs: one that never ends would be read for its hash."""
    for name in names:
        if is_device_or_pipe(folder / name):
            raise FormatError("is no regular file", where=name)


def output_key(name: str) -> str:
    """Return the key of a name as outputs are written: with "/", and no dots."""
    return name_key(posixpath.normpath(name.replace(os.sep, "/")))


def _step_files(job: Job) -> Iterator[str]:
    for step in job.steps:
        yield from step.files


def _problem(job: Job, real_of: RealPath, read: Iterable[str]) -> str:
    """Problem of the output of a job by its own files, empty without any. read: by its steps."""
    real = real_of(os.path.join(job.folder, job.output))
    key, input, *files = (name_key(real_of(os.path.join(job.folder, name))) for name in (job.output, job.input, *read))
    if key == input:
        return f"'{job.input}' is its own output ('{job.output}' is a link to it, below one, or differs by case only)"
    if key in files:
        return f"'{job.output}', the output of '{job.input}', is a file that its own steps read"
    if not real.startswith(os.path.join(real_of(str(job.folder)), "")):
        return f"'{job.output}' leads out of the folder of the settings, by a link"
    return f"'{job.output}' is no regular file" if is_device_or_pipe(real) else ""


def _real_paths() -> RealPath:
    """A function that follows links as `os.path.realpath`, which looks up folders once: many files have few."""
    folder_of = cache(os.path.realpath)

    @cache
    def real_of(path: str) -> str:
        folder, name = os.path.split(path)
        return os.path.realpath(path) if os.path.islink(path) else os.path.join(folder_of(folder), name)

    return real_of
