"""Text formats: decoding of any encoding, parsing of numbers, errors with their line."""

from __future__ import annotations

import math

import numpy as np

from anim.arrays import Floats
from anim.errors import FormatError

DIGIT_SEPARATOR = "_"  # valid in Python (1_000), but not in these formats
MAX_COUNT = 10**15
MAX_NUMBER = 1e15  # greatest number accepted: products of lengths in float32 do not overflow


def error_at(line: int, problem: str) -> FormatError:
    """Return the error for a line (from 1)."""
    return FormatError(problem, where=f"line {line}")


def decode_text(data: bytes) -> str:
    """Return the text of a file in UTF-8, UTF-16 with a byte order mark, or else Latin-1.

    All line ends become \\n.
    decode_text(b"a\\r\\nb\\rc") → "a\\nb\\nc"
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
    """Return the number of a word, None for other words, infinite numbers or those above 1e15.

    parse_number("1e3") → 1000.0
    """
    try:
        value = float(text)
    except ValueError:
        return None
    if DIGIT_SEPARATOR in text:
        return None
    return value if math.isfinite(value) and abs(value) <= MAX_NUMBER else None


def parse_count(digits: str) -> int:
    """Return the number of a word of digits, at most MAX_COUNT: Python refuses thousands of digits."""
    return MAX_COUNT if len(digits.lstrip("0")) >= len(str(MAX_COUNT)) else int(digits)


def parse_cell(text: str, line: int, what: str) -> float:
    """Return the number in a cell. Raises FormatError with the line."""
    value = parse_number(text)
    if value is None:
        raise error_at(line, f"{what} is '{text[:40]}' (expected a number up to {MAX_NUMBER:g})")
    return value


def check_times(times: Floats, lines: list[int]) -> None:
    """Raise FormatError with the line for the first time that is not after the previous one."""
    steps = np.diff(times)
    if (steps <= 0).any():
        k = int(np.argmax(steps <= 0)) + 1
        raise error_at(lines[k], f"time {times[k]:g} s after {times[k - 1]:g} s (expected increasing times)")
