"""MOTION section of a BVH: frame time and rows, counted independently of the header."""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from anim.arrays import Floats
from anim.exchange.formats.bvh_hierarchy import fail
from anim.exchange.formats.text import DIGIT_SEPARATOR, MAX_NUMBER, parse_count
from anim.exchange.formats.text import parse_number as number_of

RATES = (*(n * 1000 / 1001 for n in (24, 30, 48, 60, 120)), 10, 12, 15, 20, 24, 25, 30, 48, 50, 60, 72, 75, 90, 100,
         120, 144, 150, 200, 240, 250, 300, 480, 500, 1000)  # fmt: skip
RATE_TOLERANCE_FRAMES = 1e-3  # fraction of a frame; a frame time has few digits
ROUNDING_FRAMES = 1e-7  # fraction of a frame; rounding error of nine digits
MIN_SECONDS, MAX_SECONDS = 1e-6, 1e6
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"


@dataclass(frozen=True, slots=True)
class BvhFrames:
    """Rows (F, C) in file units and degrees, frames per second, and notes about corrected faults."""

    rows: Floats
    fps: float
    notes: tuple[str, ...]


def read_frames(lines: list[str], start: int, column: int, channels: int) -> BvhFrames:
    """Return the MOTION section, with the word in line `start` (from 0) ending at `column`.

    channels: values per row. Rows may be wrapped. A row count other than the header's is noted; fewer than half of it
    is a truncated file. Raises FormatError with the line.
    """
    claimed, stated, body = _head(lines, start, column)
    numbers = _parse_rows(lines, body)
    if not channels:
        fail(start + 1, "no joint has a channel: there is no motion")
    _check_columns(lines, body, len(numbers), channels, claimed)
    rows = numbers.reshape(-1, channels)
    notes = []
    if not len(rows) and not claimed:
        fail(len(lines), "there are no frames")
    if len(rows) != claimed:
        if not len(rows) or 2 * len(rows) < claimed:
            fail(len(lines), f"the file holds {len(rows)} of {claimed} claimed frames (truncated?)")
        notes.append(f"Frames says {claimed}, the file holds {len(rows)}: all of them are read")
    seconds = float(stated)
    fps = _snap_rate(seconds)
    if not _is_rounded(stated, 1 / fps):
        notes.append(f"frame time {seconds:g} s is taken for 1/{fps:g} s")
    return BvhFrames(rows, fps, tuple(notes))


def _head(lines: list[str], start: int, column: int) -> tuple[int, str, int]:
    """Stated frame count, seconds per frame as written, and the first line (from 0) of rows, cut at its start."""
    lines[start] = lines[start][column:]
    line, found = _find(lines, start, r"\s*Frames\s*:?\s*(\d+)(?!\.?\d)", "Frames: and a whole number")
    claimed = parse_count(found)
    line, found = _find(lines, line, rf"\s*Frame\s*Time\s*:?\s*({NUMBER})(?!\S)", "Frame Time: and seconds")
    seconds = float(found)
    if not MIN_SECONDS <= seconds <= MAX_SECONDS:
        fail(line + 1, f"Frame Time is {found[:40]} (expected seconds, {MIN_SECONDS:g} to {MAX_SECONDS:g})")
    return claimed, found, line


def _find(lines: list[str], start: int, pattern: str, expected: str) -> tuple[int, str]:
    number = start
    while number < len(lines) and not lines[number].strip():
        number += 1
    if number == len(lines):
        fail(number, f"the file ends here (expected {expected}; truncated?)")
    match = re.match(pattern, lines[number], re.IGNORECASE)
    if match is None:
        fail(number + 1, f"'{lines[number].strip()[:40]}' (expected {expected})")
    lines[number] = lines[number][match.end() :]
    return number, match[1]


def _parse_rows(lines: list[str], body: int) -> Floats:
    words = " ".join(lines[body:])
    try:
        numbers: Floats = np.array([*map(float, words.split())], np.float64)
        is_valid = not len(numbers) or np.abs(numbers).max() <= MAX_NUMBER  # False for NaN
        if is_valid and DIGIT_SEPARATOR not in words:
            return numbers
    except ValueError:
        pass
    for number, line in enumerate(lines[body:], body + 1):
        for place, text in enumerate(line.split(), 1):
            if number_of(text) is None:
                fail(number, f"number {place} is '{text[:40]}' (expected a number up to {MAX_NUMBER:g})")
    raise AssertionError


def _check_columns(lines: list[str], body: int, count: int, channels: int, claimed: int) -> None:
    """Raise FormatError for rows that do not match the channel count; wrapped ones may break anywhere."""
    per_line = [(number, len(line.split())) for number, line in enumerate(lines[body:], body + 1) if line.strip()]
    lengths = {length for _, length in per_line}
    one_per_line = len(per_line) == claimed and len(lengths) == 1
    if not per_line or (count % channels == 0 and not (one_per_line and lengths != {channels})):
        return
    right = sum(length == channels for _, length in per_line)
    for number, length in per_line:
        if length != channels and (2 * right > len(per_line) or len(per_line) == claimed):
            cut_off = number == per_line[-1][0] and length < channels
            hint = "; truncated?" if cut_off else ""
            fail(number, f"{length} numbers in a row (expected {channels}, one per channel{hint})")
    fail(per_line[-1][0], f"the last frame has {count % channels} of {channels} numbers (truncated?)")


def _snap_rate(seconds: float) -> float:
    """Frames per second: a standard rate if the frame time equals one within its digits."""
    rate = min(RATES, key=lambda rate: abs(rate * seconds - 1))
    return rate if abs(rate * seconds - 1) < RATE_TOLERANCE_FRAMES else 1 / seconds


def _is_rounded(stated: str, seconds: float) -> bool:
    """Return True if a frame time is these seconds, rounded to its own decimals: 0.0333333 is 1/30, 0.0334 is not.

    Nine digits are enough in any case: some programs compute in float32, and cut digits off instead of rounding.
    """
    step = 10.0 ** int(Decimal(stated).as_tuple().exponent)  # 0 for a million digits, which Decimal has no step for
    return abs(float(stated) - seconds) <= max(step / 2, ROUNDING_FRAMES * float(stated))
