"""Vertex caches on disk and in pipes: which format a path has, and its reader or writer set to work, frame by frame."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from anim.caches import formats
from anim.caches.files import suffix
from anim.caches.settings import Reading, Writing, Written
from anim.errors import AnimError
from anim.model import VertexCache
from cli import folders, streams
from cli.errors import UsageError


@dataclass(frozen=True, slots=True)
class Loaded:
    """A cache that was opened: what messages call it, and its format's ending."""

    cache: VertexCache
    name: str
    ending: str
    _folder: folders.Folder

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
            inputs = folders.inputs(path, stack)
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
        staged = folders.outputs(path, away, dry_run=dry_run)
        try:
            written = write(cache, staged, writing)
            size = staged.size
            if not dry_run and path == streams.PIPE:
                written = _told(written, staged.to_stdout())
            elif not dry_run:
                staged.publish()
        except OSError as error:
            raise UsageError(f"{path}: can't be written ({(error.strerror or str(error)).lower()})") from None
        finally:
            staged.clear()
    return Saved(staged.names, size, written)


def _told(written: Written, left: tuple[str, ...]) -> Written:
    """What the writer said, and which files a pipe has no place for."""
    if not left:
        return written
    return Written(written.max_error, (*written.notes, f"not written, since the output is a pipe: {', '.join(left)}"))
