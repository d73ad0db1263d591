"""Where bytes come from and go to: files, pipes, and the folder beside a .gltf. No other module opens a path, but
`cli.io.cache_folders` for what is streamed, and of the library `anim.files` and `anim.gltf.io.gltf_files`."""

from __future__ import annotations

import difflib
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import TypeAlias

import numpy as np

from anim.errors import AnimError, FormatError, OutputError
from anim.files import atomic, links, resolver
from anim.gltf.document import Buffer, Bytes, Document, items, node_label
from anim.gltf.io import container, gltf_files, uri
from cli.errors import UsageError
from cli.io import images, output_names
from cli.text import Voice

PIPE = "-"
MAX_TRIES = 20  # of opening a .gltf with its buffers, while others replace it

AUDIBLE = Voice()
Opener: TypeAlias = Callable[[Bytes, container.Resolve | None], Document]


@dataclass(frozen=True, slots=True)
class Source:
    """An input: its document, what messages call it, its size with its .bin files, its real folder, its own bytes."""

    document: Document
    name: str
    size: int
    folder: Path | None
    data: Bytes

    def is_beside(self, output: str) -> bool:
        """Return whether `output` lies in the same folder, so that relative URIs stay right."""
        if self.folder is None or output == PIPE:
            return False
        return links.followed(Path(output)).parent.resolve() == self.folder.resolve()

    def bytes_of(self, document: Document) -> Bytes | None:
        """Return the bytes of the input where they are still those of a document: nothing of it was changed."""
        return self.data if document is self.document and not document.expanded else None

    def is_at(self, path: str) -> bool:
        """Return whether this is the file at `path`."""
        return self.folder is not None and os.path.realpath(self.name) == os.path.realpath(path)


@contextmanager
def source(path: str, voice: Voice = AUDIBLE, opener: Opener = container.read) -> Iterator[Source]:
    """Give the document at `path`, "-" for stdin; errors raised inside name the input.

    voice: says what had to be mended to read it. opener: makes a document of bytes.
    """
    name = called(path)
    try:
        data, document = _received(opener) if path == PIPE else _opened(links.followed(Path(path)), opener)
        folder = None if path == PIPE else links.followed(Path(path)).parent
        note_mended(document, name, voice)
        yield Source(document, name, len(data) + _external_size(document), folder, data)
    except (UsageError, OutputError):
        raise
    except AnimError as error:
        raise error.at(name, ": ") from None


@contextmanager
def content(path: str, *, ending: str = ".glb") -> Iterator[tuple[Bytes, str]]:
    """Give the bytes at `path`, "-" for stdin, and what messages call them; errors raised inside name the input.

    ending: of the files that are meant, for the hint where `path` is a folder.
    """
    name = called(path)
    try:
        yield _stdin() if path == PIPE else resolver.mapped(Path(path), ending), name
    except (UsageError, OutputError):
        raise
    except AnimError as error:
        raise error.at(name, ": ") from None


def note_mended(document: Document, name: str, voice: Voice) -> None:
    """Say what had to be mended to read a document, nothing of most. name: of the input."""
    if not document.expanded:
        return
    first, more = document.expanded[0], len(document.expanded) - 1
    words = (f" and {more} more have", "them") if more else (" has", "it")
    problem = f"{node_label(document.json, first)}{words[0]} a matrix although a clip animates {words[1]}"
    voice.say(f"note: {name}: {problem}: taken apart into translation, rotation and scale")


def write(
    document: Document, path: str, source: Source | None, *, unchanged: Bytes | None = None, dry_run: bool = False
) -> int:
    """Write a document and return its size in bytes: a GLB or, where `path` ends in .gltf, text with its .bin beside.

    The size is that of all these files, also of those that stay as they are. source: the input that the document comes
    from: external buffers and images that are still right from the output's folder keep their URI, and none of its
    files is ever removed. In another folder images are copied beside the output, and no file is overwritten. Files
    appear whole or not at all, and only if their bytes differ from what is there; else the time of the file at `path`
    is updated. unchanged: bytes that say the same already (`Source.bytes_of`), written where they do as they are.
    """
    copies: dict[Path, Bytes] = {}
    if source is not None and source.folder is not None and path != PIPE and not source.is_beside(path):
        document, copies = images.along(document, source.folder, links.followed(Path(path)).parent)
        unchanged = None if copies else unchanged  # some may have got other names
    if not dry_run:
        images.write_copies(copies)
    if path.lower().endswith(".gltf"):
        same_folder = source is not None and source.is_beside(path)
        spared = [] if source is None or source.is_at(path) else list(_files_beside(source))
        text = None if unchanged is None or unchanged[:4].tobytes() == container.MAGIC else unchanged
        size = gltf_files.write(
            document, Path(path), same_folder=same_folder, spared=spared, text=text, dry_run=dry_run
        )
        return size + (sum(map(_size_outside, document.buffers)) if same_folder else 0)
    content = container.glb(document)
    if unchanged is not None and container.is_glb(unchanged) and not _external_size(document):
        content = [unchanged]
    if not dry_run:
        write_bytes(content, path)
    return sum(len(piece) for piece in content)


def write_bytes(pieces: Iterable[Bytes], path: str) -> None:
    """Write pieces to a file, whole or not at all, or to stdout for "-"; never binary to a terminal."""
    if path == PIPE:
        _no_terminal()
        _to_stdout(pieces)
    else:
        atomic.write_file(Path(path), list(pieces))


def write_text(text: str, path: str = PIPE) -> None:
    """Write a text product to a file, whole or not at all, or to stdout: UTF-8 whatever the locale.

    Half a surrogate pair, which JSON names can hold and UTF-8 can't, becomes \\ud83d: what JSON itself calls it.
    """
    with commit_text_after(text, path):
        pass


@contextmanager
def commit_text_after(text: str, path: str) -> Iterator[None]:
    """Write a text product like `write_text`, a file so that it takes its place after the block, or not at all."""
    content = np.frombuffer(text.encode(errors="backslashreplace"), np.uint8)
    if path == PIPE:
        _to_stdout([content])
        yield
    else:
        with atomic.commit_after(Path(path), [content]):
            yield


def check_output(path: str) -> None:
    """Raise UsageError at once, before any work, where a glTF can't be written to `path`, or its ending says another.

    A name without ending is a GLB; what is no plain file (/dev/null, a named pipe) may be called anything.
    """
    check_binary(path)
    if path == PIPE or (ending := Path(path).suffix).lower() in ("", *gltf_files.GLTF_SUFFIXES):
        return
    target = links.followed(Path(path))
    if target.exists() and not target.is_file():
        return
    near = difflib.get_close_matches(ending.lower(), gltf_files.GLTF_SUFFIXES, n=1)
    expected = " or ".join((", ".join(gltf_files.GLTF_SUFFIXES[:-1]), gltf_files.GLTF_SUFFIXES[-1]))
    raise UsageError(
        f"{path}: glTF is no {ending.lower()} (expected {expected}, or a name without ending)",
        help=f"did you mean {PurePath(path).with_suffix(near[0])}?" if near else "",
    )


def check_binary(path: str) -> None:
    """Raise UsageError or OutputError at once, before any work, where no binary can be written to `path`."""
    if path == PIPE:
        _no_terminal()
    else:
        check_file(path)


def check_file(path: str, placeholders: Sequence[str] = ()) -> None:
    """Raise UsageError or OutputError at once, before any work, where no file can be written at `path`.

    placeholders: what may stand in its name as {this}.
    """
    if not path:
        raise UsageError("the output has an empty name")
    output_names.check_placeholders(path, placeholders)
    try:
        target = links.followed(Path(path))
        if target.is_dir():
            raise UsageError(f"{path}: is a folder (expected a file name)")
        if not target.parent.is_dir():
            raise UsageError(f"{path}: there is no folder '{target.parent}'")
        if target.is_file() or not target.exists():
            atomic.check_writable(Path(path))
            if not os.access(target.parent, os.W_OK):
                raise OutputError(f"{path}: can't be written (no permission to write in its folder)")
    except PermissionError:
        raise OutputError(f"{path}: can't be written (permission denied)") from None
    except OSError as error:  # a name that no file can have
        raise UsageError(f"{path}: can't be written ({(error.strerror or str(error)).lower()})") from None


def called(path: str) -> str:
    """Return what messages call an input."""
    return "stdin" if path == PIPE else path or "''"


def _no_terminal() -> None:
    if sys.stdout is not None and sys.stdout.isatty():
        raise UsageError("the output is binary and stdout is a terminal", help="name an output file, or pipe it on")


def _to_stdout(pieces: Iterable[Bytes]) -> None:
    if sys.stdout is None:
        raise UsageError("stdout is closed", help="name an output file")
    out = sys.stdout.buffer
    try:
        for piece in pieces:
            out.write(piece.data)
        out.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or what is left fails once more at exit
        raise atomic.not_written("stdout", error) from None


def _stdin() -> Bytes:
    if sys.stdin is None:
        raise UsageError("stdin is closed: name a file, or pipe a GLB into stdin")
    if sys.stdin.isatty():
        raise UsageError("no input: name a file, or pipe a GLB into stdin")
    return np.frombuffer(sys.stdin.buffer.read(), np.uint8)


def _received(opener: Opener) -> tuple[Bytes, Document]:
    data = _stdin()
    return data, opener(data, resolver.missing)


def _opened(path: Path, opener: Opener) -> tuple[Bytes, Document]:
    """Bytes and document of a file, and its buffers opened while it was there: if it is replaced meanwhile, again."""
    for _ in range(MAX_TRIES):
        before = _stamp(path)
        data, buffers = resolver.mapped(path), resolver.Beside(path.parent)
        document = opener(data, buffers.open)
        outside = [each.uri for each in document.buffers if each.uri is not None and not uri.is_data(each.uri)]
        for address in outside:
            with suppress(FormatError):  # raised again where its bytes are asked for
                buffers.open(uri.relative_path(address))
        if not outside or _stamp(path) == before:
            break
    return data, document


def _stamp(path: Path) -> tuple[int, ...]:
    """What changes when a file is replaced."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return ()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _files_beside(source: Source) -> Iterator[Path]:
    """Yield where the buffers and images of an input lie."""
    for about in (*items(source.document.json, "buffers"), *items(source.document.json, "images")):
        address = about.get("uri")
        if source.folder is not None and address is not None and not uri.is_data(address):
            with suppress(FormatError):
                yield source.folder / uri.relative_path(address)


def _external_size(document: Document) -> int:
    return sum(map(_size_outside, document.buffers))


def _size_outside(buffer: Buffer) -> int:
    """Bytes of a buffer that is a file of its own, 0 of others."""
    is_file = buffer.uri is not None and not uri.is_data(buffer.uri) and not buffer.replaced
    return buffer.byte_length if is_file else 0


def missing(document: Document, folder: Path | None) -> Iterator[tuple[str, str]]:
    """Yield place and problem of every image that can't be found from the input's folder."""
    for i, about in enumerate(items(document.json, "images")):
        address = about.get("uri")
        if folder is None or address is None or uri.is_data(address):
            continue
        try:
            resolver.place(folder, uri.relative_path(address))
        except FormatError as error:
            yield f"image {i}", error.problem
