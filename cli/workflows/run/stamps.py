"""Stamps of files: size and modification time, of the files of a job and of their buffers and images."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeAlias

Stamp: TypeAlias = tuple[int, int]  # bytes, ns
MAX_SIZE = 1 << 63  # of a file, in bytes


def stamp_of(path: str | Path) -> Stamp | None:
    """Return size and modification time of a file; None without one."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_size, found.st_mtime_ns


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
