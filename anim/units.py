"""Numbers in text: parsing of lengths, angles and fractions with units, plain decimals, and counts with a noun."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Sequence

from anim.errors import RangeError

BYTES_PER_UNIT = {"": 1, "b": 1, "kb": 1000, "mb": 1_000_000, "gb": 10**9, "kib": 1024, "mib": 1 << 20, "gib": 1 << 30}
_NUMBER = r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([a-zµ°%]*)\s*"
_ZERO = r"\s*0+(\.0*)?\s*(%|m|cm|mm|um|µm)?\s*"
_ZERO_ANGLE = r"\s*0+(\.0*)?\s*(deg|°|rad)?\s*"
LENGTHS = {"": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
ANGLES = {"deg": math.pi / 180, "°": math.pi / 180, "rad": 1.0}
MAX_FRACTION = 1e6  # of a length or a range; with more, limits computed from it can exceed all numbers
MAX_LISTED = 8  # names in a message
FEW = 3  # names in a message about something else
MIN_EXPONENT_VALUE = 1e15  # more digits than a double has; 1e300 would be a line of 301


def format_number(value: float, digits: int) -> str:
    """Return the value rounded to `digits` significant digits: "0.41", "102", "1200", and from 1e15 on "1.5e+15"."""
    if abs(value) >= MIN_EXPONENT_VALUE:
        return f"{value:.{digits}g}"
    rounded = f"{float(f'{value:.{digits}g}'):.10f}"
    return rounded.rstrip("0").rstrip(".")


def plural(count: int, noun: str, many: str = "") -> str:
    """Return "1 clip", "3 clips"; with `many`, a plural without s: "3 vertices"."""
    return f"{count} {noun if count == 1 else many or noun + 's'}"


def list_some(names: Sequence[str], most: int = MAX_LISTED) -> str:
    """Return at most `most` names: "a, b, c", or with most=3 of 15 "a, b, c and 12 more"."""
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def parse_fraction(text: str, name: str) -> float:
    """Return a fraction above 0, at most MAX_FRACTION: "0.1%" or a number without unit. Raises RangeError otherwise.

    parse_fraction("0.1%", "--tolerance") → 0.001
    """
    value, unit = _split(text, name)
    if unit not in ("", "%") or value <= 0:
        raise RangeError(f"{name} is '{text}' (expected a share above 0, like 0.1% or 0.001)")
    return _check_fraction(value / 100 if unit else value, text, name)


def parse_length(text: str, name: str, diagonal: Callable[[], float]) -> float:
    """Return a length above 0 in metres: "0.5mm", "2cm", metres without unit, or "0.1%" of `diagonal()`.

    Raises RangeError otherwise.
    """
    value, unit = _split(text, name)
    if (unit not in LENGTHS and unit != "%") or value <= 0:
        raise RangeError(f"{name} is '{text}' (expected a length above 0, like 0.5mm, 2cm or 0.1%)")
    return _check_fraction(value / 100, text, name) * diagonal() if unit == "%" else value * LENGTHS[unit]


def is_zero(text: str) -> bool:
    """Return True for a length or fraction of 0, with or without unit: "0", "0.0mm", "0%"."""
    return re.fullmatch(_ZERO, text) is not None


def is_zero_angle(text: str) -> bool:
    """Return True for an angle of 0, with or without unit: "0", "0deg"."""
    return re.fullmatch(_ZERO_ANGLE, text) is not None


def has_unit(text: str) -> bool:
    """Return True if a valid length or angle has a unit: "0.5mm", not "0.5"."""
    return not text.rstrip()[-1:].isdigit() and not text.rstrip().endswith(".")


def parse_angle(text: str, name: str) -> float:
    """Return an angle above 0 in radians from "0.05deg" or "0.001rad".

    Raises RangeError otherwise, or without unit.
    """
    value, unit = _split(text, name)
    if unit not in ANGLES or value <= 0:
        raise RangeError(f"{name} is '{text}' (expected an angle above 0 with its unit, like 0.05deg or 0.001rad)")
    return value * ANGLES[unit]


def parse_size(text: str, name: str) -> int:
    """Return a number of bytes above 0: "800kB", "1.5 MB", "65536". Raises RangeError otherwise."""
    value, unit = _split(text.lower(), name) if re.fullmatch(_NUMBER, text.lower()) else (0.0, "")
    size = min(value * BYTES_PER_UNIT.get(unit, 0), sys.maxsize)
    if size < 1:
        raise RangeError(f"{name} is '{text}' (expected a size like 800kB, 1.5MB or 65536)")
    return int(size)


def _check_fraction(value: float, text: str, name: str) -> float:
    if value > MAX_FRACTION:
        raise RangeError(f"{name} is '{text}' (expected at most {100 * MAX_FRACTION:g}%)")
    return value


def _split(text: str, name: str) -> tuple[float, str]:
    match = re.fullmatch(_NUMBER, text)
    if match is None or not math.isfinite(float(match[1])):  # "1e400" is infinite, and would pass every limit
        raise RangeError(f"{name} is '{text}' (expected a number with a unit)")
    return float(match[1]), match[2]
