"""Files of a run's cache, which may have come with a project of somebody else: no links, devices or pipes."""

from __future__ import annotations

import io
import os
import stat
from pathlib import Path

from anim.arrays import Bytes
from anim.errors import OutputError
from anim.files import atomic, special_files

NO_LINK = getattr(os, "O_NOFOLLOW", 0)  # Windows has none
HELP = "delete it, or name another folder with --cache"


def read(path: Path) -> bytes:
    """Return the bytes of a regular file. Raises OSError for all others."""
    with special_files.open_regular(path) as file:
        return file.read()


def write(folder: Path, path: Path, data: Bytes) -> None:
    """Write a file below the folder of a cache, atomically; a pipe or device is replaced. Raises OutputError."""
    check_links(folder, path)
    with atomic.name_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        if special_files.is_device_or_pipe(path):
            path.unlink()
    atomic.write_file(path, [data])


def open_for_lines(path: Path, *, append: bool) -> io.FileIO:
    """Open a file of a cache's folder for writing, unbuffered: closing it writes nothing. Raises OutputError."""
    check_links(path.parent, path)
    flags = os.O_WRONLY | os.O_CREAT | NO_LINK | special_files.NO_WAIT | (os.O_APPEND if append else 0)
    with atomic.name_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        file = io.FileIO(path, "w", opener=lambda name, _: os.open(name, flags | getattr(os, "O_CLOEXEC", 0), 0o666))
        try:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise OutputError(f"{path}: is no regular file", help=HELP)
            if not append:
                file.truncate(0)
        except BaseException:
            file.close()
            raise
    return file


def check_links(folder: Path, path: Path) -> None:
    """Raise OutputError if a path, or a folder between `folder` and it, is a link: it may lead anywhere."""
    for each in (path, *path.parents):
        if each == folder:
            return
        if each.is_symlink():
            raise OutputError(f"{each}: is a link, which a cache doesn't have", help=HELP)
