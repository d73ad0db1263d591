"""Stdout: every byte of a product, or one line that says why not."""

from __future__ import annotations

import select
import sys
from collections.abc import Iterable
from typing import Any

from anim.errors import not_written
from cli.errors import UsageError


def write(pieces: Iterable[bytes | memoryview]) -> None:
    """Write all bytes of all pieces. Raises UsageError where stdout is closed, OutputError where it takes no more.

    The system may take a part only of what one write gives it: on a disk that is nearly full, or more than 2 GiB into
    a pipe. And a pipe that is not to block, as some programs hand down, may take nothing until its reader has read.
    """
    if sys.stdout is None:
        raise UsageError("stdout is closed", help="name an output file")
    try:
        sys.stdout.flush()
        file = getattr(sys.stdout.buffer, "raw", sys.stdout.buffer)  # no buffer where PYTHONUNBUFFERED says so
        for piece in pieces:
            _write_whole(file, memoryview(piece).cast("B"))
    except OSError as error:
        raise not_written("stdout", error) from None


def write_text(text: str) -> None:
    """Write text as UTF-8, whatever the locale: half a surrogate pair becomes \\ud83d."""
    write([text.encode(errors="backslashreplace")])


def check_no_terminal() -> None:
    """Raise UsageError where binary would go to a terminal."""
    if sys.stdout is not None and sys.stdout.isatty():
        raise UsageError("the output is binary and stdout is a terminal", help="name an output file, or pipe it on")


def _write_whole(file: Any, data: memoryview) -> None:
    done = 0
    while done < len(data):
        count = file.write(data[done:])
        if count is None:  # a pipe that would block
            select.select([], [file], [])
        else:
            done += count
