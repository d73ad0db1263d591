"""Files that are read and written a piece at a time, several side by side: what is too long for `cli.io.documents`."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import BinaryIO

import numpy as np

from anim.caches.sniffing import HEAD
from anim.caches.storage import COPY_BYTES
from anim.errors import FormatError
from anim.files import links
from anim.files.atomic import AtomicOutputs
from cli.errors import UsageError
from cli.io import documents


def inputs(path: str, stack: ExitStack) -> CacheFolder:
    """Return the file at `path` and what is beside it; "-" for stdin, which is kept in a file for as long as `stack`.

    Raises UsageError where stdin is a terminal; FormatError when what is asked for can't be opened.
    """
    return CacheFolder(Path(path)) if path != documents.PIPE else _received(stack)


def outputs(path: str, away: str, *, dry_run: bool = False) -> AtomicOutputs:
    """Return a place for the file at `path` and what goes beside it; `away`: a folder for what is not to stay."""
    is_pipe = path == documents.PIPE
    place = links.resolve_links(Path(path))
    folder = Path(away) if dry_run or is_pipe else place.parent
    return AtomicOutputs(folder, "stdout" if is_pipe else place.name)


def to_stdout(staged: AtomicOutputs) -> None:
    """Write the main file to stdout."""
    with staged.files[staged.main].open("rb") as file:
        pieces = iter(lambda: file.read(COPY_BYTES), b"")
        documents.write_bytes((np.frombuffer(piece, np.uint8) for piece in pieces), documents.PIPE)


class CacheFolder:
    """Inputs in a folder."""

    def __init__(self, path: Path) -> None:
        path = links.resolve_links(path)
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


def _received(stack: ExitStack) -> CacheFolder:
    """Stdin as a file in a folder of its own, so that it can be read more than once."""
    if sys.stdin is None or sys.stdin.isatty():
        raise UsageError("no input: name a file, or pipe a cache into stdin")
    folder = stack.enter_context(tempfile.TemporaryDirectory())
    path = Path(folder) / "stdin"
    with path.open("wb") as file:
        shutil.copyfileobj(sys.stdin.buffer, file, COPY_BYTES)
    return CacheFolder(path)
