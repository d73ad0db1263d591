"""Size against error: the curve of a file, and the smallest error that fits a number of bytes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

ERROR_FRACTIONS = tuple(
    10.0 ** (-exponent / 2) for exponent in range(10, 3, -1)
)  # of the diagonal: 1e-5 to 1e-2, two a decade
LEAST, MOST = 1e-6, 0.1  # of the diagonal: where a bound that fits is looked for
STEPS = 9  # of halving the logarithm: within 2 % of the smallest such bound


@dataclass(frozen=True, slots=True)
class RatePoint:
    """A bound, m, with the bytes of the file it leads to and the error, m, that is left.

    animation: bytes of keys and of their JSON, without meshes and images.
    """

    max_error: float
    size: int
    error: float
    animation: int = 0


def curve(
    diagonal: float, tried: Callable[[float], RatePoint], shares: Sequence[float] = ERROR_FRACTIONS
) -> Iterator[RatePoint]:
    """Yield sizes at bounds from small to large. tried: makes one, for a bound in metres."""
    for share in sorted(shares):
        yield tried(share * diagonal)


def smallest_error(max_bytes: int, diagonal: float, tried: Callable[[float], RatePoint]) -> RatePoint | None:
    """Return the smallest bound found that takes at most `max_bytes`; None where even a tenth of the diagonal doesn't.

    Halves the logarithm of the bound; sizes fall with it but for the noise of the search, some percent.
    """
    exact = tried(0.0)
    if exact.size <= max_bytes:
        return exact
    best = tried(MOST * diagonal)
    if best.size > max_bytes:
        return None
    low, high = math.log(LEAST * diagonal), math.log(MOST * diagonal)
    for _ in range(STEPS):
        middle = (low + high) / 2
        found = tried(math.exp(middle))
        if found.size <= max_bytes:
            best, high = found, middle
        else:
            low = middle
    return best
