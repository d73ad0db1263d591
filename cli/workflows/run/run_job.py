"""Work on one file of a run: its steps in this process, from bytes to bytes, and the output."""

from __future__ import annotations

import bisect
import itertools
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from anim import __version__
from anim.arrays import Bytes
from anim.errors import UnsupportedError
from anim.gltf.document import json_array
from anim.gltf.io import container, images
from cli import errors, main
from cli.io.documents import PIPE
from cli.streams import StepStreams, use_streams
from cli.workflows.run.cache import FileHashes, ResultCache, path_key
from cli.workflows.run.job import (
    EMPTY,
    Job,
    JobResult,
    WrittenOutput,
    argument_of,
    image_folder,
    input_size,
    write_output,
)
from cli.workflows.run.stamps import stamp_of, stamp_read, status_of

MAX_FIRST_BYTES, MAX_LAST_BYTES = 20_000, 10_000  # of messages, together half of a pipe's buffer


class StepsResult(NamedTuple):
    """Result of the steps of a job; see also `JobResult`.

    files: that they read. product: the GLB that the last one wrote, empty if one fails. lines: messages of the steps
    that were done.
    """

    code: int
    files: Sequence[Path] = ()
    product: Bytes = EMPTY
    lines: Sequence[str] = ()
    failed_step: str = ""


def run_job(job: Job) -> JobResult:
    """Run the steps of a file, and write its output; errors are reported in the result.

    Of the steps that were done, a job that fails has warnings and notes only: their other lines are about a result that
    is not written.
    """
    began, began_ns = time.perf_counter(), time.time_ns()
    stamp = stamp_of(job.folder / job.input)
    streams = StepStreams(job.input, EMPTY, job.folder)
    written = WrittenOutput()
    step_errors: list[str] = []
    done = StepsResult(errors.BUG)

    def work() -> int:
        nonlocal done, written
        _check_version(job.version)
        done = run_steps(job, streams, step_errors)
        if done.code == errors.DONE:
            if job.cache is not None:
                store(job, done.product, done.files, began_ns, step_errors)
            written = write_output(job, done.product, done.files, began_ns)
        return done.code

    with use_streams(streams):
        code = errors.run_guarded(work)
    seconds = time.perf_counter() - began
    lines = done.lines if code == errors.DONE else filter(is_notice, done.lines)
    return JobResult(
        code,
        shorten([*lines, *streams.messages]),
        written.size,
        stamp,
        seconds,
        input_size(job),
        written.files,
        written.copies,
        tuple(step_errors),
        written.stamps,
        done.failed_step,
    )


def is_notice(line: str) -> bool:
    """Return whether a line of a step is a warning or a note."""
    return line.startswith(("warning: ", "note: "))


def shorten(messages: Sequence[str]) -> tuple[str, ...]:
    """Return the first and last of many messages: errors are the last.

    They fit in the buffer of a pipe, so that a worker which is killed leaves none that is half written.
    """
    ends = list(itertools.accumulate(len(each.encode()) for each in messages))
    if not ends or ends[-1] <= MAX_FIRST_BYTES + MAX_LAST_BYTES:
        return tuple(messages)
    first = bisect.bisect_right(ends, MAX_FIRST_BYTES)
    last = bisect.bisect_left(ends, ends[-1] - MAX_LAST_BYTES) + 1
    return (*messages[:first], f"… {last - first} more lines", *messages[last:])


def _check_version(version: str) -> None:
    if version != __version__:
        raise UnsupportedError(f"the worker has version {__version__} of gltf-anim (expected {version})")


def run_steps(job: Job, errors_to: StepStreams, step_errors: list[str]) -> StepsResult:
    """Run the steps.

    errors_to: streams that get the messages of a step that fails. step_errors: gets their errors, as in `JobResult`.
    """
    files: list[Path] = []
    lines: list[str] = []
    data = EMPTY
    for number, step in enumerate(job.steps, 1):
        streams = StepStreams(job.input, data, job.folder, job.cores, image_folder(job) if number > 1 else None)
        with use_streams(streams):
            code = main.run(step.words(argument_of(job.input) if number == 1 else PIPE))
        files += streams.files
        if code != errors.DONE:
            errors_to.messages += streams.messages
            failed = f"step {number} of {len(job.steps)} ({step.line})"
            return StepsResult(code, files, lines=lines, failed_step=failed)
        lines += streams.messages
        step_errors += [f"{step.label} {streams.error}"] if streams.error else []
        data = np.frombuffer(b"".join(streams.output), np.uint8)
    return StepsResult(errors.DONE, files, data, lines)


def store(job: Job, product: Bytes, files: Sequence[Path], began_ns: int, step_errors: Sequence[str]) -> None:
    """Keep the result in the cache, with the hashes of all files that were read besides the input.

    Not if the input was changed since its key was made, or another file since the steps began, a time in ns: the result
    may be that of other content.
    """
    hashes = FileHashes()
    others = {os.path.relpath(path, job.folder): hashes.hash(str(path)) for path in files}
    others.pop(os.path.normpath(job.input), None)
    if status_of(job.folder / job.input) != job.status or stamp_read(job.folder, others, began_ns) is None:
        return
    named = {os.path.normpath(name) for step in job.steps for name in step.files}
    key = job.key if named.issuperset(others) else path_key(job.key, job.input)
    document = container.read(product)
    is_plain = not any(images.external_uri(image) for image in json_array(document.json, "images"))
    assert job.cache is not None
    ResultCache(job.cache).store(key, product, others, is_plain=is_plain, step_errors=step_errors)
