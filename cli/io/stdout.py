"""Stdout: complete output, or an error."""

from __future__ import annotations

import select
import sys
from collections.abc import Iterable
from typing import Any

from anim.errors import not_written
from cli.errors import UsageError


def write(pieces: Iterable[bytes | memoryview]) -> None:
    """Write all bytes. Raises UsageError if stdout is closed, OutputError if a write fails.

    The system may write only a part of the bytes per call: on a disk that is nearly full, or above 2 GiB into a pipe.
    A non-blocking pipe, as some parent processes pass on, may accept nothing until its reader has read.
    """
    if sys.stdout is None:
        raise UsageError("stdout is closed", help="name an output file")
    try:
        sys.stdout.flush()
        file = getattr(sys.stdout.buffer, "raw", sys.stdout.buffer)  # no buffer if PYTHONUNBUFFERED is set
        for piece in pieces:
            _write_whole(file, memoryview(piece).cast("B"))
    except OSError as error:
        raise not_written("stdout", error) from None


def write_text(text: str) -> None:
    """Write text as UTF-8 in any locale; a lone surrogate is escaped as \\ud83d."""
    write([text.encode(errors="backslashreplace")])


def check_no_terminal() -> None:
    """Raise UsageError if stdout, for binary data, is a terminal."""
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
