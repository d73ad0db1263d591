"""Devices, named pipes, and what this process has open: written into instead of replaced, or not read at all."""

from __future__ import annotations

import io
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

STANDARD_STREAMS = {"stdout": 1, "stderr": 2}  # in /dev
DESCRIPTOR_FOLDERS = ("/dev/fd", "/proc/self/fd", "/proc/thread-self/fd")
MAX_LINKS = 40  # that Linux follows
NO_WAIT = getattr(os, "O_NONBLOCK", 0)  # a pipe opens at once; Windows has none
BINARY = getattr(os, "O_BINARY", 0)  # on Windows alone


def is_special(path: Path) -> bool:
    """Return whether a path is written directly: a device, a named pipe, or what this process has open."""
    return descriptor_of(path) is not None or (path.exists() and not path.is_file())


def is_device_or_pipe(path: str | Path) -> bool:
    """Return whether there is something at a path that is neither a file nor a folder: reading it may never end."""
    return not os.path.isfile(path) and os.path.exists(path) and not os.path.isdir(path)


def open_regular(path: str | Path) -> io.BufferedReader:
    """Open a regular file for reading. Raises OSError for all others: a pipe is not waited for.

    Files of /proc are regular, and without a size; some never end.
    """
    file = os.fdopen(os.open(path, os.O_RDONLY | BINARY | NO_WAIT), "rb")
    try:
        found = os.fstat(file.fileno())
        if not stat.S_ISREG(found.st_mode) or (found.st_size == 0 and file.peek(1)):
            raise OSError("is no regular file")
    except BaseException:
        file.close()
        raise
    return file


def open_special(path: Path) -> BinaryIO:
    """Open it for writing: an open file at its position, which opening its path again would lose."""
    number = descriptor_of(path)
    return path.open("wb", buffering=0) if number is None else os.fdopen(os.dup(number), "wb", buffering=0)


def descriptor_of(path: Path) -> int | None:
    """Return the number of the open file that a path names: 1 of /dev/stdout, 3 of /dev/fd/3; None for other paths.

    Also of a link to such a path, and of other spellings: //dev/stdout.
    """
    for each in _followed(str(path)):
        folder, name = os.path.split(each)
        if name in STANDARD_STREAMS and _real(folder) == "/dev":
            return STANDARD_STREAMS[name]
        if name.isascii() and name.isdigit() and len(name) < 10 and _real(folder) in map(_real, DESCRIPTOR_FOLDERS):
            return int(name)
    return None


def _real(folder: str) -> str:
    """The folder that a path leads to. It takes a call of the system per part: only for names that may be special."""
    return os.path.realpath(folder).replace("//", "/")  # POSIX keeps two slashes at the start


def _followed(path: str) -> Iterator[str]:
    """A path, and what it leads to link by link: the last of /dev/stdout would be the file behind it."""
    for _ in range(MAX_LINKS):
        yield path
        if not os.path.islink(path):
            return
        path = os.path.join(os.path.dirname(path), os.readlink(path))
