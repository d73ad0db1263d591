"""Rate-distortion curve of a file, and the smallest error within a byte limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

ERROR_FRACTIONS = tuple(
    10.0 ** (-exponent / 2) for exponent in range(10, 3, -1)
)  # of the diagonal: 1e-5 to 1e-2, two a decade
MIN_BOUND_PER_DIAGONAL, MAX_BOUND_PER_DIAGONAL = 1e-6, 0.1  # range of the search
FIRST_BOUND_PER_DIAGONAL = 1e-3  # of the search
SIZE_TOLERANCE = 1e-3  # of the animation's bytes: fewer unused ones are not worth another search
LOG_BOUND_TOLERANCE = 0.0225  # of the bound's natural logarithm: within 2 % of the smallest such bound


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

    Bounds go up to a tenth of the diagonal. Sizes decrease with the bound's logarithm except for the noise of the
    search, a few percent: the bound is interpolated between the nearest ones that are too small and large enough, and
    the interval between them is bisected where that did not halve it. Stops within LOG_BOUND_TOLERANCE of the smallest
    bound, or when at most SIZE_TOLERANCE of the animation's bytes are unused.
    """
    exact = tried(0.0)
    if exact.size <= max_bytes:
        return exact
    low, high = math.log(MIN_BOUND_PER_DIAGONAL * diagonal), math.log(MAX_BOUND_PER_DIAGONAL * diagonal)
    best, over, at = None, exact.size, math.log(FIRST_BOUND_PER_DIAGONAL * diagonal)
    while best is None:
        found = tried(math.exp(at))
        if found.size <= max_bytes:
            best, high = found, at
        elif at >= high:
            return None
        else:
            low, over, at = at, found.size, high
    width = math.inf
    while high - low > LOG_BOUND_TOLERANCE and max_bytes - best.size > SIZE_TOLERANCE * best.animation:
        fraction = (over - max_bytes) / (over - best.size) if high - low <= width / 2 else 0.5
        width = high - low
        margin = 0.95 * LOG_BOUND_TOLERANCE  # a bound next to the end of the interval can close it
        at = min(max(low + fraction * width, low + margin), high - margin)
        found = tried(math.exp(at))
        if found.size <= max_bytes:
            best, high = found, at
        else:
            low, over = at, found.size
    return best
