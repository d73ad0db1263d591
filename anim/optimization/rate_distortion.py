"""Rate-distortion curve of a file, and the smallest error within a byte limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

ERROR_FRACTIONS = tuple(
    10.0 ** (-exponent / 2) for exponent in range(10, 3, -1)
)  # of the diagonal: 1e-5 to 1e-2, two a decade
MIN_BOUND_PER_DIAGONAL, MAX_BOUND_PER_DIAGONAL = 1e-6, 0.1  # range of the search
NUM_BISECTIONS = 9  # of the bound's logarithm: within 2 % of the smallest such bound


@dataclass(frozen=True, slots=True)
class RatePoint:
    """A bound, m, with the size of the resulting file in bytes and its error, m.

    animation: bytes of keys and of their JSON, without meshes and images.
    """

    max_error: float
    size: int
    error: float
    animation: int = 0


def curve(
    diagonal: float, tried: Callable[[float], RatePoint], fractions: Sequence[float] = ERROR_FRACTIONS
) -> Iterator[RatePoint]:
    """Yield sizes at bounds from small to large. tried: optimizes with a bound in metres."""
    for fraction in sorted(fractions):
        yield tried(fraction * diagonal)


def smallest_error(max_bytes: int, diagonal: float, tried: Callable[[float], RatePoint]) -> RatePoint | None:
    """Return the smallest bound found that takes at most `max_bytes`; None if there is none.

    Bounds go up to a tenth of the diagonal. Bisects the logarithm of the bound; sizes decrease with it except for the
    noise of the search, a few percent.
    """
    exact = tried(0.0)
    if exact.size <= max_bytes:
        return exact
    best = tried(MAX_BOUND_PER_DIAGONAL * diagonal)
    if best.size > max_bytes:
        return None
    low, high = math.log(MIN_BOUND_PER_DIAGONAL * diagonal), math.log(MAX_BOUND_PER_DIAGONAL * diagonal)
    for _ in range(NUM_BISECTIONS):
        middle = (low + high) / 2
        found = tried(math.exp(middle))
        if found.size <= max_bytes:
            best, high = found, middle
        else:
            low = middle
    return best
