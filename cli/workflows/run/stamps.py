"""Stamps of files: size and modification time, of the files of a job and of their buffers and images."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias

Stamp: TypeAlias = tuple[int, int]  # bytes, ns


def stamp_of(path: str | Path) -> Stamp | None:
    """Return size and modification time of a file; None without one."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_size, found.st_mtime_ns


def stamp_files(folder: Path, paths: Iterable[str | Path]) -> dict[str, Stamp | None]:
    """Return the stamps of files by their path from a folder."""
    names = (os.path.relpath(folder / path, folder) for path in paths)
    return {name: stamp_of(folder / name) for name in names}
