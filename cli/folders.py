"""Files that are read and written a piece at a time, several side by side: `cli.streams` for what is too long for it.

Outputs are temporary neighbors that are renamed when all of them are whole, the main file last, and only where their
bytes differ from what is there.
"""

from __future__ import annotations

import filecmp
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np

from anim.caches.beginnings import HEAD
from anim.caches.files import PIECE
from anim.errors import FormatError
from anim.gltf.document import Bytes
from cli import streams
from cli.errors import UsageError
from cli.replacing import mode_of, neighbor


def inputs(path: str, stack: ExitStack) -> Folder:
    """Return the file at `path` and what is beside it; "-" for stdin, which is kept in a file for as long as `stack`.

    Raises UsageError where stdin is a terminal; FormatError when what is asked for can't be opened.
    """
    return Folder(Path(path)) if path != streams.PIPE else _received(stack)


def outputs(path: str, away: str, *, dry_run: bool = False) -> Staged:
    """Return a place for the file at `path` and what goes beside it; `away`: a folder for what is not to stay."""
    is_pipe = path == streams.PIPE
    folder = Path(away) if dry_run or is_pipe else Path(path).parent
    return Staged(folder, "stdout" if is_pipe else Path(path).name)


class Folder:
    """Inputs in a folder."""

    def __init__(self, path: Path) -> None:
        self.main = path.name
        self.sizes: dict[str, int] = {}
        self._folder = path.parent

    def open(self, name: str) -> BinaryIO:
        """The file of this name, from its beginning."""
        path = self._folder / name
        try:
            if path.is_dir():
                raise FormatError("is a folder")
            file = path.open("rb")
            self.sizes[name] = os.fstat(file.fileno()).st_size
            return file
        except OSError as error:
            where = "" if name == self.main else f"'{name}'"
            raise FormatError(f"can't be read ({(error.strerror or str(error)).lower()})", where=where) from None

    def beginning(self, name: str) -> tuple[bytes, int]:
        """The first bytes of a file, and its size."""
        with self.open(name) as file:
            return file.read(HEAD), self.sizes[name]

    def names(self) -> Sequence[str]:
        """Names of all files in the folder."""
        try:
            return sorted(os.listdir(self._folder))
        except OSError as error:
            raise FormatError(f"can't be read ({(error.strerror or str(error)).lower()})") from None


@dataclass
class Staged:
    """Outputs as temporary files beside those whose place they are to take, where links lead."""

    folder: Path
    main: str
    files: dict[str, Path] = field(default_factory=dict)

    def size(self, names: Sequence[str]) -> int:
        """Bytes of these files together."""
        return sum(self.files[name].stat().st_size for name in names)

    @property
    def names(self) -> tuple[str, ...]:
        """All files, the main one last."""
        return tuple(sorted(self.files, key=lambda name: name == self.main))

    def create(self, name: str) -> BinaryIO:
        """A new file of this name, open for writing and reading back."""
        path = Path(os.path.realpath(self.folder / name))
        if path.exists() and not path.is_file():  # what lies beside /dev/null is not for everybody to write
            path = Path(tempfile.gettempdir()) / name
        handle, temporary = neighbor(path)
        self.files[name] = Path(temporary)
        return os.fdopen(handle, "w+b")

    def publish(self) -> None:
        """Give the files their names, where their bytes are new."""
        for name in self.names:
            temporary, path = self.files[name], Path(os.path.realpath(self.folder / name))
            if path.exists() and not os.access(path, os.W_OK):
                raise UsageError(f"{self.folder / name}: is read-only")
            if path.exists() and not path.is_file():  # /dev/null, a named pipe
                with temporary.open("rb") as source, path.open("wb") as target:
                    shutil.copyfileobj(source, target, PIECE)
            elif not path.exists() or not filecmp.cmp(temporary, path, shallow=False):
                os.chmod(temporary, mode_of(path))
                os.replace(temporary, path)

    def to_stdout(self) -> None:
        """Write the main file to stdout."""
        streams.write_bytes(_pieces(self.files[self.main]), streams.PIPE)

    def clear(self) -> None:
        """Remove what is still temporary."""
        for temporary in self.files.values():
            with suppress(OSError):
                temporary.unlink()


def _received(stack: ExitStack) -> Folder:
    """Stdin as a file in a folder of its own, so that it can be read more than once."""
    if sys.stdin is None or sys.stdin.isatty():
        raise UsageError("no input: name a file, or pipe a cache into stdin")
    folder = stack.enter_context(tempfile.TemporaryDirectory())
    path = Path(folder) / "stdin"
    with path.open("wb") as file:
        shutil.copyfileobj(sys.stdin.buffer, file, PIECE)
    return Folder(path)


def _pieces(path: Path) -> Iterator[Bytes]:
    with path.open("rb") as file:
        while piece := file.read(PIECE):
            yield np.frombuffer(piece, np.uint8)
