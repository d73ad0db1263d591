"""Input and output files of caches: one main file and its companions, by name.

The library opens no paths here: it requests binary files from these protocols. `Memory` keeps them in a dict; the
command line implements them for folders and pipes.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import BinaryIO, Protocol

from anim.errors import FormatError
from anim.files import resolver

COPY_BYTES = 1 << 24  # approximate bytes that streaming readers and writers process at a time


class Inputs(Protocol):
    """Files to read. main: name of the requested one."""

    main: str

    def open(self, name: str) -> BinaryIO:
        """Return a file at its start, seekable. Raises FormatError for an unknown name."""

    def names(self) -> Sequence[str]:
        """Return the names of all files in the main one's folder, itself included, sorted."""


class Outputs(Protocol):
    """Files to write. main: the requested name."""

    main: str

    @property
    def folder(self) -> os.PathLike[str] | None:
        """Folder that the files will be in; None for none."""

    def create(self, name: str) -> BinaryIO:
        """Return an empty file, seekable, that becomes `name` on close."""


@dataclass
class Memory:
    """Files in a dict: both Inputs and Outputs, for Python users and tests."""

    main: str
    files: dict[str, bytes] = field(default_factory=dict)
    folder: os.PathLike[str] | None = None

    def open(self, name: str) -> BinaryIO:
        """Return a file at its start."""
        if name not in self.files:
            raise FormatError(f"'{name}' is not beside the file")
        return io.BytesIO(self.files[name])

    def names(self) -> Sequence[str]:
        """Return the names of all files, sorted."""
        return sorted(self.files)

    def create(self, name: str) -> BinaryIO:
        """Return an empty file."""
        return _MemoryFile(self.files, name)


def companion_name(name: str, ending: str) -> str:
    """Return a companion's unique name: companion_name("walk.pc2", "-rest.ply") → "walk.pc2-rest.ply"."""
    return PurePath(name).name + ending


def suffix(name: str) -> str:
    """Return the file extension of a format: suffix("A/Walk.PC2") → ".pc2"."""
    return PurePath(name).suffix.lower()


def read_exactly(file: BinaryIO, count: int, what: str) -> bytes:
    """Return the next `count` bytes. Raises FormatError at the end of the file."""
    data = file.read(count)
    if len(data) < count:
        raise FormatError(f"is truncated: {what} has {len(data)} bytes of {count}")
    return data


def size_of(file: BinaryIO) -> int:
    """Return the size of a seekable file in bytes; its position is unchanged."""
    at = file.tell()
    size = file.seek(0, io.SEEK_END)
    file.seek(at)
    return size


@contextmanager
def open_bytes(inputs: Inputs, name: str) -> Iterator[bytes]:
    """Yield all bytes of a file."""
    with inputs.open(name) as file:
        yield resolver.read_all(file)


class _MemoryFile(io.BytesIO):
    """A file in memory that stores its bytes in a dict when it is closed without an error."""

    def __init__(self, files: dict[str, bytes], name: str) -> None:
        super().__init__()
        self._files, self._name = files, name

    def close(self) -> None:
        if not self.closed:
            self._files[self._name] = self.getvalue()
        super().close()
