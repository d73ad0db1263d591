"""Streamed files, several in one folder: inputs and outputs too large for `cli.io.documents`."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path, PurePath
from typing import BinaryIO

import numpy as np

from anim.arrays import Bytes
from anim.caches.registry import SIGNATURE_BYTES
from anim.caches.storage import COPY_BYTES
from anim.caches.temporary_files import temporary_folder
from anim.errors import FormatError, not_written
from anim.files import resolver
from anim.files.atomic import AtomicOutputs
from anim.files.special_files import descriptor_of
from anim.memory import limit_for
from cli.errors import UsageError
from cli.io import command_files, documents


def inputs(path: str, stack: ExitStack) -> CacheFolder:
    """Return the folder of the file at `path`; "-": stdin, in a temporary file until `stack` closes.

    Raises UsageError if stdin is a terminal; FormatError if a requested file can't be opened.
    """
    documents.check_name(path)
    if path == documents.PIPE:
        return _received(stack)
    real = resolver.resolve_links(Path(path))
    return CacheFolder(real.parent, real.name)


def outputs(path: str, away: str, *, dry_run: bool = False) -> AtomicOutputs:
    """Return the outputs for `path` and its companion files; `away`: a folder for temporary files."""
    is_pipe = path == documents.PIPE
    target = Path(path) if descriptor_of(Path(path)) is not None else resolver.resolve_links(Path(path))
    folder = Path(away) if dry_run or is_pipe else target.parent
    if not dry_run and not is_pipe:
        command_files.add_output(path)
    return AtomicOutputs(folder, "stdout" if is_pipe else target.name, suffix=PurePath(path).suffix)


def to_stdout(staged: AtomicOutputs) -> None:
    """Write the main file to stdout."""
    with staged.files[staged.main].open("rb") as file:
        pieces = iter(lambda: file.read(COPY_BYTES), b"")
        documents.write_bytes((np.frombuffer(piece, np.uint8) for piece in pieces), documents.PIPE)


class CacheFolder:
    """Input files of one folder. main: with links resolved."""

    def __init__(self, folder: Path, main: str) -> None:
        self.main = main
        self.sizes: dict[str, int] = {}
        self._folder = folder

    def open(self, name: str) -> BinaryIO:
        """Open the file of this name: one that another names must be a regular file beside it."""
        path = self._folder / name if name == self.main else resolver.locate(self._folder, name)
        try:
            if path.is_dir():
                raise FormatError("is a folder")
            file = path.open("rb")
            command_files.add_companions(self._folder / self.main, path)
            self.sizes[name] = os.fstat(file.fileno()).st_size
            return file
        except OSError as error:
            where = "" if name == self.main else f"'{name}'"
            raise FormatError(f"can't be read ({(error.strerror or str(error)).lower()})", where=where) from None

    def read_head(self, name: str) -> tuple[bytes, int]:
        """First bytes of a file, and its size."""
        with self.open(name) as file:
            return file.read(SIGNATURE_BYTES), self.sizes[name]

    @property
    def paths(self) -> list[Path]:
        """Paths of all files opened so far, the main one first."""
        return [self._folder / name for name in sorted(self.sizes, key=lambda name: name != self.main)]

    def names(self) -> Sequence[str]:
        """Names of all files in the folder."""
        try:
            return sorted(os.listdir(self._folder))
        except OSError as error:
            raise FormatError(f"can't be read ({(error.strerror or str(error)).lower()})") from None


class StagedFolder(CacheFolder):
    """Outputs that are written but not yet renamed, by their later names, with the other files of their folder."""

    def __init__(self, staged: AtomicOutputs) -> None:
        super().__init__(staged.folder, staged.names[-1])
        self._files = staged.files

    def open(self, name: str) -> BinaryIO:
        """Open an output, or a file beside it."""
        if name not in self._files:
            return super().open(name)
        self.sizes[name] = self._files[name].stat().st_size
        return self._files[name].open("rb")

    def names(self) -> Sequence[str]:
        """Names of all files in the folder after the outputs are renamed."""
        return sorted({*super().names(), *self._files})

    def resolve(self, address: str) -> Bytes:
        """Return the bytes of an output, or of a file beside or below it. Raises FormatError."""
        if address not in self._files:
            return resolver.open_relative(self._folder, address)
        with self.open(address) as file:
            return np.frombuffer(file.read(), np.uint8)


def _received(stack: ExitStack) -> CacheFolder:
    """Stdin as a file in a temporary folder, so that it can be read more than once."""
    if sys.stdin is None or sys.stdin.isatty():
        raise UsageError("no input: name a file, or pipe a cache into stdin")
    _refuse_endless()
    path = Path(stack.enter_context(temporary_folder())) / "stdin"
    try:
        with path.open("wb") as file:
            file.writelines(_blocks())
    except OSError as error:
        raise not_written("the temporary file for stdin", error).advise("TMPDIR names another folder for it") from None
    return CacheFolder(path.parent, path.name)


def _refuse_endless() -> None:
    """Raise FormatError for a device that gives bytes: it would fill the disk. /dev/null is an empty file."""
    try:
        is_device = stat.S_ISCHR(os.fstat(sys.stdin.fileno()).st_mode)
    except OSError:  # bytes in memory
        return
    if is_device and sys.stdin.buffer.read(1):
        raise FormatError("is a device (expected a file, or a pipe)")


def _blocks() -> Iterator[bytes]:
    try:
        yield from resolver.read_blocks(sys.stdin.buffer, limit_for(0), block=COPY_BYTES)
    except OSError as error:
        raise FormatError(f"stdin can't be read ({(error.strerror or str(error)).lower()})") from None
