"""The fewest pieces that keep an error below a tolerance: as long as possible from left to right, then evened out."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError

Errors: TypeAlias = Callable[[Floats, Floats], Floats]  # of the pieces from a (B,) to b (B,): their errors (B,)

MIN_TOLERANCE = 1e-7  # of the range: what float32 values resolve
SHORTEST = 1e-6  # of the whole; shorter pieces would fall together in float32 key times
CANDIDATES = 16  # ends tried at once
REFINEMENTS = 4  # rounds of CANDIDATES: an end is found to 16⁻⁴ of the rest
EVEN_ROUNDS = 6  # halvings of the tolerance while the number of pieces stays
EVEN_LIMIT = 64  # with more pieces the last one is no longer odd enough to matter


def subdivide(errors: Errors, edges: tuple[float, ...], tolerance: float) -> tuple[float, ...]:
    """Return the ends of the fewest pieces whose errors stay within `tolerance`: `edges` and what must lie between.

    errors: the error of each piece from a to b (B,). edges: increasing, each one an end of pieces.
    As many pieces as needed and no more, if a part of a good piece is a good piece; then their errors are evened out.
    No piece is shorter than 1e-6: next to a vertical slope one of those may miss the tolerance.
    Raises RangeError for a tolerance below 1e-7 or not finite.
    """
    if not (MIN_TOLERANCE <= tolerance < np.inf):
        raise RangeError(f"tolerance is {tolerance:g} (expected {MIN_TOLERANCE:g} or more)")
    ends = list(edges[:1])
    for start, end in pairwise(edges):
        ends += _evened(errors, start, end, tolerance)
    return tuple(ends)


def _evened(errors: Errors, start: float, end: float, tolerance: float) -> list[float]:
    """Return the ends of the fewest pieces from start to end, for nearly the least tolerance that needs no more."""
    best = _greedy(errors, start, end, tolerance, limit=None)
    assert best is not None
    count = len(best)
    if not 1 < count <= EVEN_LIMIT:
        return best
    low, high = tolerance * ((count - 1) / count) ** 4 / 2, tolerance
    for _ in range(EVEN_ROUNDS):
        middle = (low + high) / 2
        ends = _greedy(errors, start, end, middle, limit=count)
        if ends is None:
            low = middle
        else:
            best, high = ends, middle
    return best


def _greedy(errors: Errors, start: float, end: float, tolerance: float, *, limit: int | None) -> list[float] | None:
    """Return the ends of pieces that are as long as the tolerance lets them, or None if there are more than `limit`."""
    ends: list[float] = []
    while start < end:
        if limit is not None and len(ends) == limit:
            return None
        start = _longest(errors, start, end, tolerance)
        ends.append(start)
    return ends


def _longest(errors: Errors, start: float, end: float, tolerance: float) -> float:
    """Return the last end before which every candidate is within the tolerance."""
    low, high, rounds = start, end, 0
    while rounds < REFINEMENTS or low == start:
        ends = np.linspace(low, high, CANDIDATES + 1)[1:]
        good = errors(np.full(CANDIDATES, start), ends) <= tolerance
        bad = int(np.argmin(good)) if not good.all() else CANDIDATES
        if bad == CANDIDATES:
            low = high
            break
        low, high, rounds = float(ends[bad - 1]) if bad else low, float(ends[bad]), rounds + 1
        if high - start <= SHORTEST:
            low = start + SHORTEST
            break
    if low >= end or end - start <= 2 * SHORTEST:
        return end
    return min(low, end - SHORTEST)
