"""Input and output of documents and text: files, pipes, and the folder of a .gltf.

No other module opens a path, except `cli.io.cache_folders` for streams, and in the library `anim.files` and
`anim.gltf.io`.
"""

from __future__ import annotations

import difflib
import io
import os
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePath

import numpy as np

from anim.errors import AnimError, DataRangeError, FormatError, OutputError
from anim.files import resolver
from anim.gltf.document import Bytes, Document, node_label
from anim.gltf.io import container
from anim.gltf.io.source import (
    Opener,
    Source,
    buffer_files,
    external_files,
    glb_chunks,
    open_bytes,
    open_file,
    write_file,
)
from anim.gltf.validation.extensions import PHYSICS, unknown_required
from anim.units import list_some
from cli import tables
from cli.errors import RefusedOutputError, UsageError
from cli.io import command_files, output_folders, output_names, stdout
from cli.streams import locate, record_files, step_streams
from cli.text import Reporter

PIPE = "-"
AUDIBLE = Reporter()


@contextmanager
def source(
    path: str, reporter: Reporter = AUDIBLE, opener: Opener = container.read, *, uses: Collection[str] = ()
) -> Iterator[Source]:
    """Give the document at `path`, "-" for stdin; errors raised inside name the input.

    reporter: reports the fixes made on reading. opener: makes a document of bytes. uses: extensions that only this
    command supports.
    """
    name = called(path)
    try:
        found = _open_pipe(name, opener) if path == PIPE else _open_file(path, opener)
        repaired_note(found.document, name, reporter)
        _note_unknown_extensions(found.document, name, reporter, uses)
        yield found
    except (UsageError, OutputError):
        raise
    except (np.linalg.LinAlgError, OverflowError) as error:
        raise DataRangeError(f"has values too large to compute with ({str(error).lower()})", where=name) from None
    except AnimError as error:
        raise error.at(name, ": ") from None


@contextmanager
def content(
    path: str, *, ending: str = ".glb", read: Callable[[io.BufferedReader], bytes] = resolver.read_all
) -> Iterator[tuple[Bytes, str]]:
    """Give the bytes at `path`, "-" for stdin, and their name; errors raised inside name the input.

    ending: expected file extension, for the hint if `path` is a folder. read: limits pipes and devices.
    """
    name = called(path)
    try:
        yield _stdin(read) if path == PIPE else _read_file(path, ending, read), name
    except (UsageError, OutputError):
        raise
    except AnimError as error:
        raise error.at(name, ": ") from None


def repaired_note(document: Document, name: str, reporter: Reporter) -> None:
    """Report the fixes made on reading a document, if any. name: of the input."""
    if not document.expanded:
        return
    first, more = document.expanded[0], len(document.expanded) - 1
    words = (f" and {more} more have", "them") if more else (" has", "it")
    problem = f"{node_label(document.json, first)}{words[0]} a matrix although a clip animates {words[1]}"
    reporter.info(f"note: {name}: {problem}: taken apart into translation, rotation and scale")


def _note_unknown_extensions(document: Document, name: str, reporter: Reporter, uses: Collection[str]) -> None:
    required = [each for each in unknown_required(document.json) if each not in uses]
    bodies = [each for each in required if each in PHYSICS]
    if unknown := [each for each in required if each not in PHYSICS]:
        names = tables.quote(list_some(unknown))
        words = f"requires {names}, not supported here: kept as it is, and nothing is measured with it"
        reporter.info(f"note: {name}: {words}")
    if bodies:
        words = "kept as it is; bodies stay where the clips put them, simulate rigid moves them"
        reporter.info(f"note: {name}: requires {list_some(bodies)}: {words}")


def write(
    document: Document,
    path: str,
    source: Source | None,
    *,
    unchanged: Bytes | None = None,
    dry_run: bool = False,
    reporter: Reporter = AUDIBLE,
    in_place: bool = False,
) -> int:
    """Write a document to a file or, for "-", as a GLB to stdout; return its size in bytes.

    Files are written as by `anim.gltf.io.source.write_file`. source: the document's input. unchanged: bytes of the
    same document (`Source.bytes_of`), written unchanged if they fit the output. reporter: reports buffer files of a
    replaced .gltf that stay. in_place: the user named no output: then that is a warning, even when quiet.
    """
    if path != PIPE:
        return write_file(
            document,
            path,
            source,
            unchanged=unchanged,
            dry_run=dry_run,
            note=lambda words: _report_unused(tables.escape_control(words), reporter, in_place=in_place),
        )
    content = glb_chunks(document, unchanged)
    if not dry_run:
        write_bytes(content, path)
    return sum(len(piece) for piece in content)


def _report_unused(words: str, reporter: Reporter, *, in_place: bool) -> None:
    if in_place:
        reporter.warn(words)
    else:
        reporter.info(f"note: {words}")


def write_bytes(pieces: Iterable[Bytes], path: str) -> None:
    """Write bytes to a file atomically, or to stdout for "-"; never binary to a terminal."""
    if path == PIPE:
        stdout.check_no_terminal()
        stdout.write(piece.data for piece in pieces)
    else:
        from anim.files import atomic

        atomic.write_file(Path(path), list(pieces))


def write_text(text: str | bytes, path: str = PIPE) -> None:
    """Write text to a file atomically, or to stdout, as `encode` does."""
    with commit_text_after(text, path):
        pass


def encode(text: str | bytes) -> bytes:
    """Return text in UTF-8, in any locale; bytes are encoded already.

    A lone surrogate, which JSON strings can contain and UTF-8 can't, is written as its JSON escape: \\ud83d.
    """
    return text if isinstance(text, bytes) else text.encode(errors="backslashreplace")


@contextmanager
def commit_text_after(text: str | bytes, path: str) -> Iterator[None]:
    """Write text like `write_text`; a file is replaced after the block, or not at all if the block fails."""
    data = encode(text)
    if path == PIPE:
        stdout.write([data])
        yield
    else:
        from anim.files import atomic

        with atomic.commit_after(Path(path), [np.frombuffer(data, np.uint8)]):
            yield


def check_output(path: str, *, dry_run: bool = False) -> None:
    """Raise UsageError or OutputError if glTF can't be written to `path` or its extension is another format's.

    A name without extension is a GLB; devices and named pipes (/dev/null) can have any name.
    dry_run: a file must be possible all the same; stdout gets nothing.
    """
    if path != PIPE or not dry_run:
        check_binary(path)
    check_extension(path)


def check_extension(path: str) -> None:
    """Raise UsageError if the extension of an output is another format's."""
    if path == PIPE or (ending := Path(path).suffix).lower() in ("", *container.SUFFIXES):
        return
    target = resolver.resolve_links(Path(path))
    if target.exists() and not target.is_file():
        return
    near = difflib.get_close_matches(ending.lower(), container.SUFFIXES, n=1)
    expected = " or ".join((", ".join(container.SUFFIXES[:-1]), container.SUFFIXES[-1]))
    raise UsageError(
        f"{path}: glTF is no {ending.lower()} (expected {expected}, or a name without ending)",
        help=f"did you mean {PurePath(path).with_suffix(near[0])}?" if near else "",
    )


def check_binary(path: str) -> None:
    """Raise UsageError or OutputError, before any work, if no binary data can be written to `path`."""
    if path == PIPE:
        stdout.check_no_terminal()
    else:
        check_file(path)


def check_file(path: str, placeholders: Sequence[str] | None = (), *, makes_folder: bool = False) -> None:
    """Raise UsageError or OutputError, before any work, if no file can be written at `path`.

    placeholders: allowed in its name as {this}; None if they are replaced already: then braces are part of the name.
    makes_folder: whether its folder is made when it is written, as it is for a name with placeholders.
    """
    if not path:
        raise UsageError("the output has an empty name")
    if placeholders is not None:
        output_names.check_placeholders(path, placeholders)
    try:
        target = resolver.resolve_links(Path(path))
        if target.is_dir():
            raise RefusedOutputError(f"{path}: is a folder (expected a file name)")
        if path.endswith(("/", os.sep)):
            raise RefusedOutputError(f"{path}: there is no such folder (expected a file name)")
        if not target.parent.is_dir():
            is_filled_in = any(f"{{{each}}}" in path for each in placeholders or ())
            output_folders.check_missing(path, target.parent, is_made=makes_folder or is_filled_in)
        elif target.is_file() or not target.exists():
            from anim.files import atomic

            atomic.check_writable(Path(path))
            if not os.access(target.parent, os.W_OK):
                raise OutputError(f"{path}: can't be written (no permission to write in its folder)")
    except PermissionError:
        raise OutputError(f"{path}: can't be written (permission denied)") from None
    except OSError as error:  # an invalid file name
        raise RefusedOutputError(f"{path}: can't be written ({(error.strerror or str(error)).lower()})") from None


def called(path: str) -> str:
    """Return the name of an input for messages."""
    if path != PIPE:
        return path or "''"
    return "stdin" if (step := step_streams()) is None else step.name


def check_name(path: str) -> None:
    """Raise FormatError for an empty path, which would be the current folder."""
    if not path:
        raise FormatError("is no file name")


def _open_pipe(name: str, opener: Opener) -> Source:
    """The document on stdin; that of a step has its images where the first step found them."""
    found = open_bytes(_stdin(resolver.read_gltf), name, opener)
    return found if (step := step_streams()) is None else found._replace(folder=step.images)


def _open_file(path: str, opener: Opener) -> Source:
    check_name(path)
    located = locate(path)
    found = open_file(located, opener)
    record_files(Path(located), *buffer_files(found))
    command_files.add_inputs(Path(located), *filter(os.path.isfile, external_files(found)))
    return found._replace(name=path)


def _read_file(path: str, ending: str, read: Callable[[io.BufferedReader], bytes]) -> Bytes:
    check_name(path)
    located = Path(locate(path))
    found = resolver.read_file(located, ending, read=read)
    record_files(located)
    command_files.add_inputs(located)
    return found


def _stdin(read: Callable[[io.BufferedReader], bytes]) -> Bytes:
    if (step := step_streams()) is not None:
        return step.input
    if sys.stdin is None:
        raise UsageError("stdin is closed: name a file, or pipe a GLB into stdin")
    if sys.stdin.isatty():
        raise UsageError("no input: name a file, or pipe a GLB into stdin")
    buffer = sys.stdin.buffer
    return np.frombuffer(read(buffer) if isinstance(buffer, io.BufferedReader) else buffer.read(), np.uint8)
