"""Stdout: complete output, or an error."""

from __future__ import annotations

import sys
from collections.abc import Iterable

from anim.errors import not_written
from anim.files.stream import write_stream
from cli.errors import UsageError
from cli.streams import step_streams


def write(pieces: Iterable[bytes | memoryview]) -> None:
    """Write all bytes. Raises UsageError if stdout is closed, OutputError if a write fails."""
    if (step := step_streams()) is not None:
        step.output += [bytes(piece) for piece in pieces]
        return
    if sys.stdout is None:
        raise UsageError("stdout is closed", help="name an output file")
    try:
        sys.stdout.flush()
    except OSError as error:
        raise not_written("stdout", error) from None
    file = getattr(sys.stdout.buffer, "raw", sys.stdout.buffer)  # no buffer if PYTHONUNBUFFERED is set
    write_stream(file, pieces, "stdout")


def write_text(text: str) -> None:
    """Write text as UTF-8 in any locale; a lone surrogate is escaped as \\ud83d."""
    write([text.encode(errors="backslashreplace")])


def is_read_with_stderr() -> bool:
    """Return whether stdout and stderr are both a terminal, where errors of a report would be read twice."""
    streams = sys.stdout, sys.stderr
    return step_streams() is None and all(each is not None and each.isatty() for each in streams)


def check_no_terminal() -> None:
    """Raise UsageError if stdout, for binary data, is a terminal."""
    if step_streams() is None and sys.stdout is not None and sys.stdout.isatty():
        raise UsageError("the output is binary and stdout is a terminal", help="name an output file, or pipe it on")
