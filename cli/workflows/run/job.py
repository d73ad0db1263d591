"""One file of a run: its steps, its result, and its output."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import NamedTuple

import numpy as np

from anim import __version__
from anim.arrays import Bytes
from anim.errors import AnimError, not_written
from anim.files import atomic, guard, resolver
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.io.source import external_files, open_bytes, open_file, write_file
from anim.gltf.io.text_form import restore_text_form
from cli.io import command_files
from cli.reports import image_notes
from cli.text import Reporter
from cli.workflows.run.output_stamps import OutputStamps, stamp_output
from cli.workflows.run.places import check_output
from cli.workflows.run.stamps import FileStatus, Stamp, stamp_files, stamp_of, stamp_read
from cli.workflows.run.steps import EDITING, Step

EMPTY: Bytes = np.empty(0, np.uint8)


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
    failed_step: the one that failed, "step 2 of 3 (trim --to 1)"; "" if none did.
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
    failed_step: str = ""


class WrittenOutput(NamedTuple):
    """An output as it was written; see `JobResult`."""

    size: int = 0
    files: Mapping[str, Stamp | None] | None = None
    copies: tuple[str, ...] = ()
    stamps: OutputStamps | None = None


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
