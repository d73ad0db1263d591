"""Text formats: their text whoever wrote it, the numbers that they may hold, and faults with their line."""

from __future__ import annotations

import math

import numpy as np

from anim.arrays import Floats
from anim.errors import FormatError

GROUPED = "_"  # Python reads 1_000 as a number; no file means that
LIMIT = 1e15  # greatest number that is taken: float32 and products of lengths stay far from overflow


def error_at(line: int, problem: str) -> FormatError:
    """Return the error for a line (from 1)."""
    return FormatError(problem, where=f"line {line}")


def decode_text(data: bytes) -> str:
    """Return the text of a file in UTF-8, UTF-16 with its mark, or else Latin-1, with one kind of line end.

    text_of(b"a\\r\\nb\\rc") → "a\\nb\\nc"
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def parse_number(text: str) -> float | None:
    """Return the number that a word means, None where it means none, or none that is finite and below 1e15.

    number("1e3") → 1000.0
    """
    try:
        value = float(text)
    except ValueError:
        return None
    if GROUPED in text:
        return None
    return value if math.isfinite(value) and abs(value) <= LIMIT else None


def parse_cell(text: str, line: int, what: str) -> float:
    """Return the number that a cell holds. Raises FormatError with the line."""
    value = parse_number(text)
    if value is None:
        raise error_at(line, f"{what} is '{text[:40]}' (expected a finite number)")
    return value


def check_times(times: Floats, lines: list[int]) -> None:
    """Raise the FormatError of the line whose time is not behind the one before."""
    steps = np.diff(times)
    if (steps <= 0).any():
        k = int(np.argmax(steps <= 0)) + 1
        raise error_at(lines[k], f"time {times[k]:g} s after {times[k - 1]:g} s (expected increasing times)")
