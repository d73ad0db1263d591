"""Vertex caches on disk and in pipes: what `anim.caches` reads from and writes to.

Frames are streamed: into temporary neighbors that are renamed when all of them are whole, the main file last, and only
where their bytes differ from what is there.
"""

from __future__ import annotations

import filecmp
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np

from anim.caches import formats
from anim.caches.files import PIECE, suffix
from anim.caches.settings import Reading, Writing, Written
from anim.errors import AnimError, FormatError
from anim.gltf.document import Bytes
from anim.model import VertexCache
from cli import streams
from cli.errors import UsageError


@dataclass(frozen=True, slots=True)
class Loaded:
    """A cache that was opened: what messages call it, and its format's ending."""

    cache: VertexCache
    name: str
    ending: str
    _folder: _Folder

    @property
    def size(self) -> int:
        """Bytes of all files that were opened up to now."""
        return sum(self._folder.sizes.values())


@dataclass(frozen=True, slots=True)
class Saved:
    """Files that were written, the main one last, their size in bytes together, and what the writer said."""

    files: tuple[str, ...]
    size: int
    written: Written


@contextmanager
def load(path: str, reading: Reading) -> Iterator[Loaded]:
    """Give the cache at `path`, "-" for stdin, its format by the name's ending or by its first bytes.

    Its frames are read while it is used, so use it inside; errors raised there name the input.
    """
    name = "stdin" if path == streams.PIPE else path or "''"
    with ExitStack() as stack:
        try:
            inputs = _Folder(Path(path)) if path != streams.PIPE else _received(stack)
            ending = suffix(inputs.main) or formats.ending_of(*inputs.beginning())
            yield Loaded(formats.reader_for(ending)(inputs, reading), name, ending, inputs)
        except UsageError:
            raise
        except AnimError as error:
            raise error.at(name, ": ") from None


def check(path: str, ending: str | None = None) -> str:
    """Return the ending of the format that is written to `path`; `ending` instead of the name's own, ".npz" for "-".

    Raises UsageError at once, before any work, where nothing can be written or no format is called so.
    """
    if path != streams.PIPE:
        streams.check_file(path)
    found = ending or (".npz" if path == streams.PIPE else suffix(path))
    if found not in formats.CACHE_FORMATS:
        known = ", ".join(formats.CACHE_FORMATS)
        raise UsageError(f"{path}: no cache format is called '{found}' (expected {known})")
    return found


def save(cache: VertexCache, path: str, writing: Writing, *, ending: str | None = None, dry_run: bool = False) -> Saved:
    """Write a cache, "-" for stdout, in the format that the name's ending says or `ending`.

    What lies beside the main file (a rest mesh, a JSON) is left out on stdout, and a note says so.
    """
    write = formats.writer_for(check(path, ending))
    with tempfile.TemporaryDirectory() as away:
        folder = Path(away) if dry_run or path == streams.PIPE else Path(path).parent
        staged = _Staged(folder, "stdout" if path == streams.PIPE else Path(path).name)
        try:
            written = write(cache, staged, writing)
            size = sum(file.stat().st_size for file in staged.files.values())
            names = tuple(sorted(staged.files, key=lambda name: name == staged.main))
            if not dry_run:
                if path == streams.PIPE:
                    written = _to_stdout(staged, written)
                else:
                    staged.publish(names)
        except OSError as error:
            raise UsageError(f"{path}: can't be written ({(error.strerror or str(error)).lower()})") from None
        finally:
            staged.clear()
    return Saved(names, size, written)


class _Folder:
    """Inputs in a folder."""

    def __init__(self, path: Path) -> None:
        self.main = path.name
        self.sizes: dict[str, int] = {}
        self._folder = path.parent

    def open(self, name: str) -> BinaryIO:
        path = self._folder / name
        if path.is_dir():
            raise FormatError("is a folder")
        try:
            file = path.open("rb")
            self.sizes[name] = os.fstat(file.fileno()).st_size
            return file
        except OSError as error:
            where = "" if name == self.main else f"'{name}'"
            raise FormatError(f"can't be read ({(error.strerror or str(error)).lower()})", where=where) from None

    def beginning(self) -> tuple[bytes, int]:
        """The first bytes of the main file, and its size."""
        with self.open(self.main) as file:
            return file.read(64), self.sizes[self.main]

    def names(self) -> Sequence[str]:
        return sorted(os.listdir(self._folder))


def _received(stack: ExitStack) -> _Folder:
    """Stdin as a file in a folder of its own, so that it can be read more than once."""
    if sys.stdin is None or sys.stdin.isatty():
        raise UsageError("no input: name a file, or pipe a cache into stdin")
    folder = stack.enter_context(tempfile.TemporaryDirectory())
    path = Path(folder) / "stdin"
    with path.open("wb") as file:
        shutil.copyfileobj(sys.stdin.buffer, file, PIECE)
    return _Folder(path)


@dataclass
class _Staged:
    """Outputs as temporary files in the folder where they belong."""

    folder: Path
    main: str
    files: dict[str, Path] = field(default_factory=dict)

    def create(self, name: str) -> BinaryIO:
        handle, temporary = tempfile.mkstemp(prefix=f".{name}.", suffix=".tmp", dir=self.folder)
        self.files[name] = Path(temporary)
        return os.fdopen(handle, "w+b")

    def publish(self, names: Sequence[str]) -> None:
        """Give the files their names, where their bytes are new."""
        for name in names:
            temporary, path = self.files[name], Path(os.path.realpath(self.folder / name))
            if path.exists() and not os.access(path, os.W_OK):
                raise UsageError(f"{self.folder / name}: is read-only")
            if path.exists() and not path.is_file():  # /dev/null, a named pipe
                with temporary.open("rb") as source, path.open("wb") as target:
                    shutil.copyfileobj(source, target, PIECE)
            elif not path.exists() or not filecmp.cmp(temporary, path, shallow=False):
                os.chmod(temporary, streams.mode_of(path))
                os.replace(temporary, path)

    def clear(self) -> None:
        """Remove what is still temporary."""
        for temporary in self.files.values():
            with suppress(OSError):
                temporary.unlink()


def _to_stdout(staged: _Staged, written: Written) -> Written:
    streams.write_bytes(_pieces(staged.files[staged.main]), streams.PIPE)
    left = [name for name in staged.files if name != staged.main]
    if not left:
        return written
    return Written(written.max_error, (*written.notes, f"not written, since the output is a pipe: {', '.join(left)}"))


def _pieces(path: Path) -> Iterator[Bytes]:
    with path.open("rb") as file:
        while piece := file.read(PIECE):
            yield np.frombuffer(piece, np.uint8)
