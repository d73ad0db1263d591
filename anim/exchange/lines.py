"""Faults of text formats: a line number and words; and the numbers that files may hold."""

from __future__ import annotations

import math

from anim.errors import FormatError

LIMIT = 1e15  # greatest number that is taken: float32 and products of lengths stay far from overflow


def wrong(line: int, problem: str) -> FormatError:
    """Return the error for a line (from 1)."""
    return FormatError(problem, where=f"line {line}")


def number(text: str) -> float | None:
    """Return the number that a word means, None where it means none, or none that is finite and below 1e15.

    number("1e3") → 1000.0
    """
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) and abs(value) <= LIMIT else None
