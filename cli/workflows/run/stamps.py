"""Stamps of files: size and modification time, of the files of a job and of their buffers and images.

A stamp is kept for later runs. Within a run a file's status tells more: a copy with the old time is another file.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeAlias

Stamp: TypeAlias = tuple[int, int]  # bytes, ns
FileStatus: TypeAlias = tuple[int, int, int, int]  # bytes, ns of modification, ns of change, number of the file
MAX_SIZE = 1 << 63  # of a file, in bytes


def stamp_of(path: str | Path) -> Stamp | None:
    """Return size and modification time of a file; None without one."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_size, found.st_mtime_ns


def status_of(path: str | Path) -> FileStatus | None:
    """Return what changes with a file's content within a run; None without a file."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino


def is_changed_since(path: str | Path, began_ns: int) -> bool:
    """Return whether a file was written or replaced since a time, in ns since the epoch.

    The system dates files by its ticks: a change in the first few ms is not seen. Earlier times would also find files
    that a script writes just before the run.
    """
    status = status_of(path)
    if status is None:
        return False
    _, modified, changed, _ = status
    return (modified if os.name == "nt" else changed) >= began_ns  # Windows has that of creation


def parse_stamp(value: Any) -> Stamp:
    """Return a stamp that was JSON. Raises TypeError for other values."""
    if not isinstance(value, list) or len(value) != 2 or not all(type(each) is int for each in value):
        raise TypeError("is no stamp")
    return value[0], value[1]


def is_size(value: Any) -> bool:
    """Return whether a value that was JSON is a number of bytes."""
    return type(value) is int and 0 <= value < MAX_SIZE


def stamp_files(folder: Path, paths: Iterable[str | Path]) -> dict[str, Stamp | None]:
    """Return the stamps of files by their path from a folder."""
    names = (os.path.relpath(folder / path, folder) for path in paths)
    return {name: stamp_of(folder / name) for name in names}


def stamp_read(folder: Path, paths: Iterable[str | Path], began_ns: int) -> dict[str, Stamp | None] | None:
    """Return the stamps of files that were read since a time, in ns; None if one was changed since.

    Before or after it was read, nobody knows.
    """
    stamps = stamp_files(folder, paths)
    return None if any(is_changed_since(folder / name, began_ns) for name in stamps) else stamps
