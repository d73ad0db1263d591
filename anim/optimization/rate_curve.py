"""Rate curve: how the animation bytes of a file depend on the error bound, from a few measured points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from anim.optimization.rate_distortion import BOUND_EXPONENT_PER_SIZE, MAX_STEP_FACTOR, RatePoint, round_bound

MIN_EXPONENT, MAX_EXPONENT = BOUND_EXPONENT_PER_SIZE / 8, 2 * BOUND_EXPONENT_PER_SIZE
FAR = 50.0  # natural logarithm of a factor between bounds that no search reaches


class RateCurve:
    """Animation bytes against the bound, linear between measured points where both are logarithmic.

    Between two points bytes are as bound^(-1/n), with n from MIN_EXPONENT to MAX_EXPONENT; beyond the first and the
    last one n is BOUND_EXPONENT_PER_SIZE. points: in any order; those without a bound tell nothing.
    """

    def __init__(self, points: Sequence[RatePoint]) -> None:
        known = sorted((each.max_error, each.animation) for each in points if each.max_error > 0)
        bounds = [math.log(bound) for bound, _ in known] or [0.0]
        exponents = [_exponent(*low, *high) for low, high in pairwise(known)]
        falls = [(high - low) / n for (low, high), n in zip(pairwise(bounds), exponents, strict=True)]
        self._bounds = np.array([bounds[0] - FAR, *bounds, bounds[-1] + FAR])
        beyond = FAR / BOUND_EXPONENT_PER_SIZE
        self._saved = np.cumsum([0.0, beyond, *falls, beyond])  # logarithm of bytes saved against the first bound

    def size_at(self, size: float, bound: float, other: float) -> float:
        """Return the likely bytes of a result of `size` bytes at a bound, m, if searched at another one.

        They stay the same from a bound of 0.
        """
        return float(size * math.exp(self._saved_at(bound) - self._saved_at(other))) if bound else size

    def bound_for(self, excess: float, bound: float, diagonal: float) -> float:
        """Return the likely bound, m, of a result that fits; one at `bound` takes `excess` times the bytes available.

        It is at most MAX_STEP_FACTOR from `bound`, and then rounded up to one of few.
        """
        likely = math.exp(np.interp(self._saved_at(bound) + math.log(excess), self._saved, self._bounds))
        return round_bound(min(max(likely, bound / MAX_STEP_FACTOR), bound * MAX_STEP_FACTOR), diagonal)

    def _saved_at(self, bound: float) -> float:
        return float(np.interp(math.log(bound), self._bounds, self._saved))


def _exponent(bound: float, size: int, larger_bound: float, smaller_size: int) -> float:
    """The exponent n between two points, where animation bytes are as bound^(-1/n)."""
    if size <= smaller_size:
        return MAX_EXPONENT
    found = math.log(larger_bound / bound) / math.log(size / max(smaller_size, 1))
    return min(max(found, MIN_EXPONENT), MAX_EXPONENT)
