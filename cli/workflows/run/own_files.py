"""Files of a run's cache, which may have come with a project of somebody else: no links, devices or pipes."""

from __future__ import annotations

import io
import os
from pathlib import Path

from anim.arrays import Bytes
from anim.errors import OutputError
from anim.files import atomic, file_lock, special_files
from anim.files.folder_lock import lock_folder

NO_LINK = getattr(os, "O_NOFOLLOW", 0)  # Windows has none
HELP = "delete it, or name another folder with --cache"
MAX_TEXT_BYTES = 100_000_000  # of the journal and of the records: those of 100 000 files have half of it


def read(path: Path, most: int = MAX_TEXT_BYTES) -> bytes:
    """Return the bytes of a regular file of at most `most`. Raises OSError for all others: a hole has any length."""
    with special_files.open_regular(path) as file:
        if os.fstat(file.fileno()).st_size > most:
            raise OSError("is too long")
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
    """Open a file of a cache's folder to append lines, unbuffered: closing it writes nothing. Raises OutputError.

    append: to the lines that are there; else to a new file, but for lines that another process still appends. What may
    not be the cache's own, as a file with a second name, is never written into: the new one takes its place.
    """
    check_links(path.parent, path)
    flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | NO_LINK | special_files.NO_WAIT | getattr(os, "O_CLOEXEC", 0)
    with atomic.name_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with lock_folder(path.parent):
            if not _is_continued(path, append=append):
                path.unlink(missing_ok=True)
            file = io.FileIO(path, "w", opener=lambda name, _: os.open(name, flags, 0o666))
            file_lock.lock(file)
    return file


def _is_continued(path: Path, *, append: bool) -> bool:
    """Return whether lines are appended to the file that is there."""
    try:
        with special_files.open_regular(path) as file:
            found = os.fstat(file.fileno())
            is_own = found.st_nlink == 1 and found.st_size <= MAX_TEXT_BYTES
            return is_own and (append or file_lock.is_locked(file))
    except OSError:
        return False


def check_links(folder: Path, path: Path) -> None:
    """Raise OutputError if a path, or a folder between `folder` and it, is a link: it may lead anywhere."""
    for each in (path, *path.parents):
        if each == folder:
            return
        if each.is_symlink():
            raise OutputError(f"{each}: is a link, which a cache doesn't have", help=HELP)
