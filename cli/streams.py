"""Where bytes come from and go to: files, pipes, and the folder beside a .gltf. No other module opens a path, but
`cli.folders` for what is streamed, and `cli.replacing` to write."""

from __future__ import annotations

import mmap
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from anim.errors import AnimError, FormatError
from anim.gltf import container, uri
from anim.gltf.document import Buffer, Bytes, Document, items
from cli.errors import UsageError
from cli.replacing import replace_all

PIPE = "-"
OTHERS = frozenset((".bin", ".bvh", ".csv", ".dae", ".fbx", ".json", ".npz", ".obj", ".usd", ".usda", ".usdc", ".usdz"))


@dataclass(frozen=True, slots=True)
class Source:
    """An input: its document, what messages call it, its size in bytes with its .bin files, and its folder."""

    document: Document
    name: str
    size: int
    folder: Path | None


@contextmanager
def source(path: str) -> Iterator[Source]:
    """Give the document at `path`, "-" for stdin; errors raised inside name the input."""
    name = _called(path)
    try:
        data = _stdin() if path == PIPE else _mapped(Path(path))
        folder = None if path == PIPE else Path(path).parent
        document = container.read(data, None if folder is None else lambda address: _beside(folder, address))
        yield Source(document, name, len(data) + _external_size(document), folder)
    except UsageError:
        raise
    except AnimError as error:
        raise error.at(name, ": ") from None


@contextmanager
def content(path: str, *, ending: str = ".glb") -> Iterator[tuple[Bytes, str]]:
    """Give the bytes at `path`, "-" for stdin, and what messages call them; errors raised inside name the input.

    ending: of the files that are meant, for the hint where `path` is a folder.
    """
    name = _called(path)
    try:
        yield _stdin() if path == PIPE else _mapped(Path(path), ending), name
    except UsageError:
        raise
    except AnimError as error:
        raise error.at(name, ": ") from None


def write(document: Document, path: str, beside: Path | None, *, dry_run: bool = False) -> int:
    """Write a document and return its size in bytes: a GLB or, where `path` ends in .gltf, text with its .bin beside.

    The size is that of all these files, also of those that stay as they are. beside: the folder of the input: external
    buffers and images that are still right from the output's folder keep their URI. Files appear whole or not at all,
    and only if their bytes differ from what is there.
    """
    if path.lower().endswith(".gltf"):
        target = Path(path)
        same_folder = beside is not None and target.parent.resolve() == beside.resolve()
        files = container.gltf(document, target.stem, keep_external=same_folder)
        pieces = {target.parent / name: content for name, content in files.items()}
        if not dry_run:
            own = target.with_suffix(".gltf")  # x.GLTF stays that
            replace_all({target if file == own else file: content for file, content in pieces.items()})
        written = sum(len(piece) for content in pieces.values() for piece in content)
        return written + (sum(map(_size_outside, document.buffers)) if same_folder else 0)
    content = container.glb(document)
    if not dry_run:
        write_bytes(content, path)
    return sum(len(piece) for piece in content)


def write_bytes(pieces: Iterable[Bytes], path: str) -> None:
    """Write pieces to a file, whole or not at all, or to stdout for "-"; never binary to a terminal."""
    if path == PIPE:
        _no_terminal()
        _to_stdout(pieces)
    else:
        replace_all({Path(path): list(pieces)})


def write_text(text: str, path: str = PIPE) -> None:
    """Write a text product to a file, whole or not at all, or to stdout: UTF-8 whatever the locale.

    Half a surrogate pair, which JSON names can hold and UTF-8 can't, becomes \\ud83d: what JSON itself calls it.
    """
    content = np.frombuffer(text.encode(errors="backslashreplace"), np.uint8)
    if path == PIPE:
        _to_stdout([content])
    else:
        replace_all({Path(path): [content]})


def check_output(path: str) -> None:
    """Raise UsageError at once, before any work, where a glTF can't be written to `path`."""
    if path == PIPE:
        _no_terminal()
    else:
        check_file(path)
        if (ending := Path(path).suffix.lower()) in OTHERS:
            raise UsageError(f"{path}: glTF is no {ending} (expected .glb or .gltf)")


def check_file(path: str) -> None:
    """Raise UsageError at once, before any work, where no file can be written at `path`."""
    if not path:
        raise UsageError("the output has an empty name")
    target = Path(path)
    try:
        if target.is_dir():
            raise UsageError(f"{path}: is a folder (expected a file name)")
        if not target.parent.is_dir():
            raise UsageError(f"{path}: there is no folder '{target.parent}'")
    except OSError as error:  # a name that no file can have
        raise UsageError(f"{path}: can't be written ({(error.strerror or str(error)).lower()})") from None


def _called(path: str) -> str:
    """What messages call an input."""
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
        raise UsageError(f"stdout: can't be written ({(error.strerror or str(error)).lower()})") from None


def _stdin() -> Bytes:
    if sys.stdin is None:
        raise UsageError("stdin is closed: name a file, or pipe a GLB into stdin")
    if sys.stdin.isatty():
        raise UsageError("no input: name a file, or pipe a GLB into stdin")
    return np.frombuffer(sys.stdin.buffer.read(), np.uint8)


def _mapped(path: Path, ending: str = ".glb") -> Bytes:
    try:
        if path.is_dir():
            raise FormatError("is a folder", help=f"name the files: {path}/*{ending}")
        with path.open("rb") as file:
            is_plain = path.is_file() and os.fstat(file.fileno()).st_size > 0
            if not is_plain or sys.platform == "win32":  # where a mapped file can't be replaced by its output
                return np.frombuffer(file.read(), np.uint8)
            return np.frombuffer(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ), np.uint8)
    except OSError as error:
        raise FormatError(f"can't be read ({(error.strerror or str(error)).lower()})") from None


def _beside(folder: Path, address: str) -> Bytes:
    """Bytes of a file in or below the folder."""
    path = _place(folder, address)
    try:
        return _mapped(path)
    except FormatError as error:
        raise error.at(f"'{address}'", " ") from None


def _place(folder: Path, address: str) -> Path:
    """Where a file in or below the folder lies; links that lead out of it are refused."""
    path = folder / address
    try:
        outside = folder.resolve() not in path.resolve().parents
        there, regular = path.exists(), path.is_file()
    except (OSError, RuntimeError, ValueError) as error:  # a name too long, a loop of links, half a character
        raise FormatError(f"'{address[:60]}' can't be looked up ({str(error).lower()[:60]})") from None
    if outside:
        raise FormatError(f"'{address}' leads out of the file's folder (only files beside it are read)")
    if not there:
        raise FormatError(f"'{address}' is not beside the file", help=f"put it into '{folder}'")
    if not regular:
        raise FormatError(f"'{address}' is no file")
    return path


def _external_size(document: Document) -> int:
    return sum(map(_size_outside, document.buffers))


def _size_outside(buffer: Buffer) -> int:
    """Bytes of a buffer that is a file of its own, 0 of others."""
    is_file = buffer.uri is not None and not uri.is_data(buffer.uri) and not buffer.replaced
    return buffer.byte_length if is_file else 0


def missing(document: Document, folder: Path | None) -> Iterator[tuple[str, str]]:
    """Yield place and problem of every buffer and image that can't be found from the input's folder."""
    for kind in ("buffer", "image"):
        for i, about in enumerate(items(document.json, f"{kind}s")):
            address = about.get("uri")
            if folder is None or address is None or uri.is_data(address):
                continue
            try:
                _place(folder, uri.relative_path(address))
            except FormatError as error:
                yield f"{kind} {i}", error.problem


def stays_in(folder: Path | None, output: str) -> bool:
    """Return whether `output` lies in `folder`, so that relative URIs stay right."""
    return folder is not None and output != PIPE and Path(output).parent.resolve() == folder.resolve()


def left_outside(document: Document, folder: Path | None, output: str) -> str:
    """Return a note where images that the output refers to lie in another folder than it, else nothing."""
    images = [image["uri"] for image in items(document.json, "images") if not uri.is_data(image.get("uri", "data:"))]
    if not images or stays_in(folder, output):
        return ""
    return f"note: {len(images)} image{'s stay' if len(images) > 1 else ' stays'} outside ({images[0]}, …)"


def with_images(document: Document, folder: Path | None) -> Document:
    """Return the document with its external images as data URIs. Raises FormatError for one that can't be read."""
    images = []
    for i, image in enumerate(items(document.json, "images")):
        address = image.get("uri")
        if address is not None and not uri.is_data(address):
            if folder is None:
                raise FormatError("lies beside the file, but the input is a pipe", where=f"image {i}")
            data = _beside(folder, uri.relative_path(address))
            image = {**image, "uri": uri.encode_data(data.tobytes(), _media_type(data))}
        images.append(image)
    return replace(document, json={**document.json, "images": images}) if images else document


def _media_type(data: Bytes) -> str:
    head = data[:12].tobytes()
    if head.startswith(b"\x89PNG"):
        return "image/png"
    if head.startswith(b"\xff\xd8"):
        return "image/jpeg"
    if head.startswith(b"RIFF") and head[8:12] == b"WEBP":
        return "image/webp"
    return "image/ktx2" if head.startswith(b"\xabKTX 20") else "application/octet-stream"
