"""Subdivision into the fewest segments within a tolerance: greedy, then with equalized errors."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError

Errors: TypeAlias = Callable[[Floats, Floats], Floats]  # errors (B,) of the segments from a (B,) to b (B,)

MIN_TOLERANCE = 1e-7  # of the range: resolution of float32 values
MIN_SEGMENT_LENGTH = 1e-6  # of the range; shorter segments would have equal float32 key times
NUM_CANDIDATES = 16  # ends evaluated at once
NUM_REFINEMENTS = 4  # rounds of NUM_CANDIDATES: an end is found to 16⁻⁴ of the remainder
NUM_EQUALIZING_ROUNDS = 6  # halvings of the tolerance at a constant number of segments
MAX_EQUALIZED_SEGMENTS = 64  # with more segments a short last one doesn't matter


def subdivide(errors: Errors, edges: tuple[float, ...], tolerance: float) -> tuple[float, ...]:
    """Return the ends of the fewest segments with errors within `tolerance`, `edges` included.

    errors: the error of each segment from a to b (B,). edges: increasing, each one an end of segments.
    The number is minimal if errors don't grow when a segment is shortened; then the errors are equalized.
    No segment is shorter than 1e-6: next to a vertical slope such a segment may exceed the tolerance.
    Raises RangeError for a tolerance below 1e-7 or not finite.
    """
    if not (MIN_TOLERANCE <= tolerance < np.inf):
        raise RangeError(f"tolerance is {tolerance:g} (expected {MIN_TOLERANCE:g} or more)")
    ends = list(edges[:1])
    for start, end in pairwise(edges):
        ends += _equalize_errors(errors, start, end, tolerance)
    return tuple(ends)


def _equalize_errors(errors: Errors, start: float, end: float, tolerance: float) -> list[float]:
    """Return the ends of the fewest segments, at nearly the least tolerance for their number."""
    best = _subdivide_greedily(errors, start, end, tolerance, limit=None)
    assert best is not None
    count = len(best)
    if not 1 < count <= MAX_EQUALIZED_SEGMENTS:
        return best
    low, high = tolerance * ((count - 1) / count) ** 4 / 2, tolerance
    for _ in range(NUM_EQUALIZING_ROUNDS):
        middle = (low + high) / 2
        ends = _subdivide_greedily(errors, start, end, middle, limit=count)
        if ends is None:
            low = middle
        else:
            best, high = ends, middle
    return best


def _subdivide_greedily(
    errors: Errors, start: float, end: float, tolerance: float, *, limit: int | None
) -> list[float] | None:
    """Return the ends of segments of maximal length within the tolerance, or None for more than `limit`."""
    ends: list[float] = []
    while start < end:
        if limit is not None and len(ends) == limit:
            return None
        start = _find_longest(errors, start, end, tolerance)
        ends.append(start)
    return ends


def _find_longest(errors: Errors, start: float, end: float, tolerance: float) -> float:
    """Return the last candidate end up to which all candidates are within the tolerance."""
    low, high, rounds = start, end, 0
    while rounds < NUM_REFINEMENTS or low == start:
        ends = np.linspace(low, high, NUM_CANDIDATES + 1)[1:]
        good = errors(np.full(NUM_CANDIDATES, start), ends) <= tolerance
        bad = int(np.argmin(good)) if not good.all() else NUM_CANDIDATES
        if bad == NUM_CANDIDATES:
            low = high
            break
        low, high, rounds = float(ends[bad - 1]) if bad else low, float(ends[bad]), rounds + 1
        if high - start <= MIN_SEGMENT_LENGTH:
            low = start + MIN_SEGMENT_LENGTH
            break
    if low >= end or end - start <= 2 * MIN_SEGMENT_LENGTH:
        return end
    return min(low, end - MIN_SEGMENT_LENGTH)
