"""Complete writes to open binary files."""

from __future__ import annotations

import io
import select
from collections.abc import Iterable
from typing import Any

from anim.errors import not_written


def write_stream(file: Any, pieces: Iterable[bytes | memoryview], name: str) -> None:
    """Write all bytes to a binary file, buffered or not. Raises OutputError, with `name`, if that fails.

    The system may write only a part of the bytes per call: on a disk that is nearly full, or above 2 GiB into a pipe.
    A non-blocking pipe, as some parent processes pass on, may accept nothing until its reader has read.
    """
    try:
        for piece in pieces:
            _write_all(file, memoryview(piece).cast("B"))
    except OSError as error:
        raise not_written(name, error) from None


def _write_all(file: Any, data: memoryview) -> None:
    done = 0
    while done < len(data):
        count = file.write(data[done:])
        if count is not None:
            done += count
        elif isinstance(file, io.RawIOBase):  # a pipe that would block
            select.select([], [file], [])
        else:  # a file of the caller's own that returns no count
            return
