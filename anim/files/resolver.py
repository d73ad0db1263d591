"""Read files by path, or by relative address confined to a folder; links."""

from __future__ import annotations

import io
import os
import stat
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import BinaryIO

import numpy as np

from anim.arrays import Bytes
from anim.errors import FormatError, UnsupportedError
from anim.memory import limit_for

GLB_MAGIC = b"glTF"
STREAM_CHUNK_BYTES = 1 << 20
MAX_OPTIONS_BYTES = 64_000_000  # of a pipe or device: no settings have a tenth of it


class CompanionFiles:
    """Files in or below a folder, opened once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files: dict[tuple[str, int | None], Bytes] = {}

    def __call__(self, address: str) -> Bytes:
        """Return the bytes of a file, as `open` does."""
        return self.open(address)

    def open(self, address: str, most: int | None = None) -> Bytes:
        """Return the bytes of a file, or its first `most` ones.

        Raises FormatError for a missing file, or one outside the folder.
        """
        if (address, most) not in self._files:
            self._files[address, most] = open_relative(self._folder, address, most)
        return self._files[address, most]


def read_head(file: BinaryIO, most: int) -> bytes:
    """Return the first `most` bytes of an open file, or all of a shorter one. Raises as `read_all`."""
    return file.read(min(most, os.fstat(file.fileno()).st_size)) if _has_size(file) else read_all(file)[:most]


def read_all(file: BinaryIO) -> bytes:
    """Return all bytes of an open file. Raises UnsupportedError for a pipe or device above the memory limit."""
    return file.read() if _has_size(file) else b"".join(read_blocks(file, limit_for(0)))


def read_file(path: Path, ending: str = ".glb", *, read: Callable[[io.BufferedReader], bytes] = read_all) -> Bytes:
    """Return the bytes of a file, read-only. ending: expected extension, for the hint about a folder.

    A copy instead of a memory map: the system kills a process whose mapped file is rewritten in place by another.
    """
    try:
        if path.is_dir():
            raise FormatError("is a folder", help=_in_folder(path, ending))
        with path.open("rb") as file:
            return np.frombuffer(read(file), np.uint8)
    except OSError as error:
        raise FormatError(f"can't be read ({(error.strerror or str(error)).lower()})") from None


def read_gltf(file: io.BufferedReader) -> bytes:
    """Return all bytes of an open file; of what can't be a glTF only the first ones: a device may never end.

    Raises UnsupportedError for a pipe or device that is longer than the memory limit and than its header says.
    """
    head = file.peek()
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    is_glb = head[: len(GLB_MAGIC)] == GLB_MAGIC[: len(head)]
    if not is_glb and text[:1] not in (b"{", b""):
        return head
    if _has_size(file):
        return file.read()  # at once: blocks would take their memory twice
    stated = int.from_bytes(head[8:12], "little") * is_glb
    return b"".join(read_blocks(file, max(limit_for(0), stated)))


def read_options(file: BinaryIO) -> bytes:
    """Return all bytes of a file of options. Raises UnsupportedError for a pipe or device above 64 MB."""
    most = min(limit_for(0), MAX_OPTIONS_BYTES)
    return file.read() if _has_size(file) else b"".join(read_blocks(file, most, help="name a file"))


def read_blocks(
    file: BinaryIO, most: int, *, help: str = "raise `memory_limit`, or name a file", block: int = STREAM_CHUNK_BYTES
) -> Iterator[bytes]:
    """Yield the bytes of an open file in blocks. Raises UnsupportedError for a pipe or device of more than `most`."""
    size, is_bounded = 0, _has_size(file)
    while data := file.read(block):
        size += len(data)
        if size > most and not is_bounded:
            raise UnsupportedError(f"is a pipe or device with more than {most / 1e9:.3g} GB", help=help)
        yield data


def _has_size(file: BinaryIO) -> bool:
    """Return True for a file that ends at a size that the system knows: files of /proc are regular, and have none."""
    try:
        found = os.fstat(file.fileno())
    except OSError:  # bytes in memory
        return True
    return stat.S_ISREG(found.st_mode) and found.st_size > 0


def _in_folder(folder: Path, ending: str) -> str:
    """Hint instead of a folder: an existing file in it, since most commands need a file."""
    found = min(folder.glob(f"*{ending}"), default=None)
    if found is None:
        return f"name a file (there is no {ending} in it)"
    name = str(found)
    return f"name a file in it, such as {name if name[0] != '-' else f'./{name}'}"  # "-x" is an option


def open_relative(folder: Path, address: str, most: int | None = None) -> Bytes:
    """Return the bytes of a file in or below the folder, or its first `most` ones. Raises FormatError."""
    path = locate(folder, address)
    try:
        return read_file(path, read=read_all if most is None else partial(read_head, most=most))
    except FormatError as error:
        raise error.at(f"'{address}'", " ") from None


def refuse_relative(address: str) -> Bytes:
    """Raise FormatError: an input from a pipe has no other files."""
    raise FormatError(
        f"'{address}' lies beside the file, but the input is a pipe", help="give the file's path, or pipe a GLB"
    )


def refuse_without_folder(address: str) -> Bytes:
    """Raise FormatError: an input from bytes has no folder."""
    raise FormatError(
        f"'{address}' lies beside the file, but bytes have no folder",
        help="load the file's path, or anim.Asset(container.read(data, resolve=…)) with a function that reads it",
    )


def locate(folder: Path, address: str) -> Path:
    """Return the path of a file in or below the folder. Raises FormatError.

    Links to files outside the folder are rejected.
    """
    path = folder / address
    try:
        outside = folder.resolve() not in path.resolve().parents
        there, regular = path.exists(), path.is_file()
    except (OSError, RuntimeError, ValueError) as error:  # a name too long, a loop of links, a lone surrogate
        raise FormatError(f"'{address[:60]}' can't be looked up ({str(error).lower()[:60]})") from None
    if outside:
        raise FormatError(f"'{address}' leads out of the file's folder (only files beside it are read)")
    if not there:
        raise FormatError(f"'{address}' is not beside the file", help=f"put it into '{folder}'")
    if not regular:
        raise FormatError(f"'{address}' is no file")
    return path


def resolve_links(path: Path) -> Path:
    """Return the target of a link, existing or not; any other path unchanged.

    A link to a target outside the file system (/dev/stdin, which may be a pipe) is unchanged, too.
    resolve_links(s/q.gltf → ../real/q.gltf) → /…/real/q.gltf
    """
    if not os.path.islink(path):
        return path
    real = os.path.realpath(path)
    return path if os.path.exists(path) and not os.path.exists(real) else Path(real)
