"""Files that take the place of others: whole or not at all, and only where their bytes differ."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from anim.gltf.document import Bytes
from cli.errors import UsageError

RECOGNIZED = 40  # letters of a name that its temporary neighbor begins with: longer names have no room for more


def replace_all(files: Mapping[Path, list[Bytes]]) -> None:
    """Write temporary neighbors and rename them, once all are whole, over files whose bytes differ.

    files: pieces by path. Raises UsageError where one can't be written.
    """
    waiting: dict[Path, str] = {}
    named = next(iter(files))
    try:
        for named, pieces in files.items():
            path = Path(os.path.realpath(named))
            if path.exists() and not os.access(path, os.W_OK):
                raise UsageError(f"{named}: is read-only")
            if path.exists() and not path.is_file():  # /dev/null, a named pipe
                with path.open("wb") as file:
                    file.writelines(piece.data for piece in pieces)
            elif not _is_same(path, pieces):
                handle, waiting[path] = neighbor(path)
                with os.fdopen(handle, "wb") as file:
                    file.writelines(piece.data for piece in pieces)
                os.chmod(waiting[path], mode_of(path))
        for path, temporary in waiting.items():
            os.replace(temporary, path)
    except OSError as error:
        raise UsageError(f"{named}: can't be written ({(error.strerror or str(error)).lower()})") from None
    finally:
        for temporary in waiting.values():
            with suppress(FileNotFoundError):
                os.unlink(temporary)


def neighbor(path: Path) -> tuple[int, str]:
    """Make an empty file beside `path` that is to take its place; return what is open, and its name."""
    return tempfile.mkstemp(prefix=f".{path.name[:RECOGNIZED]}.", suffix=".tmp", dir=path.parent)


def mode_of(path: Path) -> int:
    """Return the permissions that a file at `path` has or would get."""
    if path.exists():
        return path.stat().st_mode & 0o7777
    umask = os.umask(0)
    os.umask(umask)
    return 0o666 & ~umask


def _is_same(path: Path, pieces: list[Bytes]) -> bool:
    if not path.is_file() or path.stat().st_size != sum(len(piece) for piece in pieces):
        return False
    with path.open("rb") as file:
        return all(file.read(len(piece)) == piece.tobytes() for piece in pieces)
