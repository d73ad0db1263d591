"""One file of a run: its steps in this process, from bytes to bytes, and the output."""

from __future__ import annotations

import bisect
import itertools
import os
import shlex
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import NamedTuple

import numpy as np

from anim import __version__
from anim.arrays import Bytes
from anim.errors import AnimError, UnsupportedError, not_written
from anim.files import atomic, guard, resolver
from anim.gltf.document import Document, json_array
from anim.gltf.io import container, images
from anim.gltf.io.source import external_files, open_bytes, open_file, write_file
from anim.gltf.io.text_form import restore_text_form
from cli import errors, main
from cli.io import command_files
from cli.io.documents import PIPE
from cli.reports import image_notes
from cli.streams import StepStreams, use_streams
from cli.text import Reporter
from cli.workflows.run.cache import FileHashes, ResultCache, path_key
from cli.workflows.run.output_stamps import OutputStamps, stamp_output
from cli.workflows.run.places import check_output
from cli.workflows.run.stamps import FileStatus, Stamp, stamp_files, stamp_of, stamp_read, status_of
from cli.workflows.run.steps import EDITING, Step

EMPTY: Bytes = np.empty(0, np.uint8)
MAX_FIRST_BYTES, MAX_LAST_BYTES = 20_000, 10_000  # of messages, together half of a pipe's buffer


@dataclass(frozen=True)
class Job:
    """A file with its steps.

    folder: of the settings, from which input and output count. cores: processes that a step may use.
    cache: folder of results, if they are kept, and the key of this one. status: of the input, whose content is in the
    key. version: of the tool that plans the job.
    """

    folder: Path
    input: str
    output: str
    steps: tuple[Step, ...]
    cores: int = 1
    cache: Path | None = None
    key: str = ""
    status: FileStatus | None = None
    version: str = __version__


@dataclass(frozen=True)
class JobResult:
    """Result of a job. code: exit code. messages: lines of the steps, errors last. size: bytes of the output.

    stamp: size and modification time of the input when the job began. seconds: of work. input_size: bytes of the input
    with its buffers, as `size` has those of the output. files: stamps by path of all other files read and written; None
    if one that was read was changed meanwhile, so that nobody knows which content the output is of. copies: images that
    were copied beside the output, by their paths from the folder of the settings. step_errors: the largest error that
    each step measured, with its name: "resample max 2.1 mm (0.1 %)". stamps: of the output, as soon as it was written.
    """

    code: int
    messages: tuple[str, ...] = ()
    size: int = 0
    stamp: Stamp | None = None
    seconds: float = 0.0
    input_size: int = 0
    files: Mapping[str, Stamp | None] | None = field(default_factory=dict)
    copies: tuple[str, ...] = ()
    step_errors: tuple[str, ...] = ()
    stamps: OutputStamps | None = None


class WrittenOutput(NamedTuple):
    """An output as it was written; see `JobResult`."""

    size: int = 0
    files: Mapping[str, Stamp | None] | None = None
    copies: tuple[str, ...] = ()
    stamps: OutputStamps | None = None


def run_job(job: Job) -> JobResult:
    """Run the steps of a file, and write its output; errors are reported in the result."""
    began, began_ns = time.perf_counter(), time.time_ns()
    stamp = stamp_of(job.folder / job.input)
    streams = StepStreams(job.input, EMPTY, job.folder)
    written = WrittenOutput()
    step_errors: list[str] = []

    def work() -> int:
        nonlocal written
        _check_version(job.version)
        code, files, product = run_steps(job, streams, step_errors)
        if code == errors.DONE:
            if job.cache is not None:
                store(job, product, files, began_ns, step_errors)
            written = write_output(job, product, files, began_ns)
        return code

    with use_streams(streams):
        code = errors.run_guarded(work)
    seconds = time.perf_counter() - began
    size, others, copies, stamps = written
    messages = shorten(streams.messages)
    return JobResult(code, messages, size, stamp, seconds, input_size(job), others, copies, tuple(step_errors), stamps)


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


def run_steps(job: Job, messages: StepStreams, step_errors: list[str]) -> tuple[int, list[Path], Bytes]:
    """Run the steps; return the exit code, the files that were read, and the GLB that the last step wrote.

    messages: streams that get the messages of all steps. step_errors: gets their errors, as in `JobResult`.
    """
    files: list[Path] = []
    data = EMPTY
    for number, step in enumerate(job.steps, 1):
        streams = StepStreams(job.input, data, job.folder, job.cores, image_folder(job) if number > 1 else None)
        with use_streams(streams):
            code = main.run(step.words(argument_of(job.input) if number == 1 else PIPE))
        messages.messages += streams.messages
        files += streams.files
        step_errors += [f"{step.label} {streams.error}"] if streams.error else []
        if code != errors.DONE:
            messages.messages.append(f"in step {number} of {len(job.steps)}: {shlex.join(step.words()[:1])}")
            return code, files, EMPTY
        data = np.frombuffer(b"".join(streams.output), np.uint8)
    return errors.DONE, files, data


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


def write_output(job: Job, product: Bytes, read: Iterable[str | Path], began_ns: int) -> WrittenOutput:
    """Write the GLB of the last step as the output, with external images copied beside it.

    read: files that the steps read, which stay when those of a replaced .gltf are removed. The same bytes are not
    written again. The result's files are those of the job besides input and output; None if one that was read, or the
    input, was changed since a time in ns. Raises AnimError.
    """
    with atomic.name_errors(Path(job.output)):  # as while somebody exchanges a folder with a link
        paths = [job.folder / each for each in read]
        size, copies = _write(job, product, paths)
        stamps = stamp_output(job.folder, job.output, copies)
        return WrittenOutput(size, _stamp_companions(job, product, paths, began_ns), copies, stamps)


def _write(job: Job, product: Bytes, spared: Sequence[Path]) -> tuple[int, tuple[str, ...]]:
    """Write the output; return its size in bytes, and the images that were copied, from the folder of the settings."""
    check_output(job, spared)
    path = job.folder / job.output
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise not_written(str(path.parent), error) from None
    folder = image_folder(job)
    source = open_bytes(product, job.output)._replace(folder=folder)
    if is_text(job.output):
        source = source._replace(document=_as_the_last_step_writes(job, source.document))
    try:
        with guard.use(files := command_files.CommandFiles()):  # of this output alone: it knows the images copied
            size = write_file(source.document, str(path), source, unchanged=product, spared=spared, within=job.folder)
    except AnimError as error:
        error.problem = error.problem.replace(str(path), job.output)
        raise
    if not source.is_in_folder(str(path)):
        for line in image_notes.notes(source.document, folder, image_notes.relative_names(str(path), files.copies)):
            Reporter().info(line)
    real = os.path.realpath(job.folder)
    copies = (os.path.relpath(os.path.realpath(each), real) for each in files.copies)
    return size, tuple(PurePath(each).as_posix() for each in copies)


def _as_the_last_step_writes(job: Job, document: Document) -> Document:
    """The document of a .gltf as the last step's command writes it to a file; by a pipe it gets a GLB."""
    if len(job.steps) == 1 and is_text(job.input):
        document = restore_text_form(document, open_file(str(job.folder / job.input)).document)
    last = job.steps[-1]
    is_embedding = last.command == ("convert",) and "--embed" in last.options
    return container.embed_buffers(document) if is_embedding else document


def _stamp_companions(job: Job, product: Bytes, read: Sequence[Path], began_ns: int) -> dict[str, Stamp | None] | None:
    """Stamps of the files that the steps read, and of buffers and images of input and output.

    product: GLB of the last step. None if a file that was read, or the input, was changed since a time in ns.
    """
    images = list(external_files(open_bytes(product, job.output)._replace(folder=image_folder(job))))
    written = external_files(open_file(str(job.folder / job.output))) if images or is_text(job.output) else ()
    others = stamp_read(job.folder, [job.input, *read, *images], began_ns)
    if others is None:
        return None
    stamps = {**others, **stamp_files(job.folder, written)}
    return {path: stamp for path, stamp in stamps.items() if path not in map(os.path.normpath, (job.input, job.output))}


def document_file(job: Job) -> Path | None:
    """Return the glTF that the steps begin with: the input, or the character that it moves; None without one."""
    first = job.steps[0]
    if first.onto:
        return job.folder / first.onto
    return job.folder / job.input if first.command[0] in EDITING else None


def image_folder(job: Job) -> Path:
    """Return the folder from which URIs of the result's images count: as single commands do, behind links."""
    return resolver.resolve_links(document_file(job) or job.folder / job.input).parent


def input_size(job: Job) -> int:
    """Return the bytes of the input with its buffers, 0 if it can't be read."""
    path = job.folder / job.input
    if is_text(job.input):
        try:
            return open_file(str(path)).size
        except AnimError:
            pass
    return (stamp_of(path) or (0, 0))[0]


def is_text(path: str) -> bool:
    """Return whether a path is that of a .gltf, which has its buffers in other files."""
    return path.lower().endswith(".gltf")


def argument_of(path: str) -> str:
    """Return a path as an argument: not an option, nor a pipe."""
    return f"./{path}" if path.startswith("-") else path
