"""Size against error: bounds of a curve, and the smallest one that fits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from anim.optimization.rate_distortion import (
    ERROR_FRACTIONS,
    MAX_BOUND_PER_DIAGONAL,
    MIN_BOUND_PER_DIAGONAL,
    RatePoint,
    curve,
    smallest_error,
)

DIAGONAL = 3.0


def _sized(max_error: float) -> RatePoint:
    """A file of 1000 bytes and 500 more for every factor of 10 below the diagonal, all of them animation."""
    size = round(1000 - 500 * math.log10(max(max_error, 1e-9) / DIAGONAL))
    return RatePoint(max_error, size, max_error, size)


def _with_meshes(max_error: float) -> RatePoint:
    """The same file with 10 MB of meshes."""
    plain = _sized(max_error)
    return replace(plain, size=10_000_000 + plain.size)


def test_a_curve_goes_from_small_bounds_to_large() -> None:
    found = list(curve(DIAGONAL, _sized))
    assert [each.max_error for each in found] == pytest.approx([share * DIAGONAL for share in ERROR_FRACTIONS])
    assert ERROR_FRACTIONS[0] == pytest.approx(1e-5)
    assert ERROR_FRACTIONS[-1] == pytest.approx(1e-2)
    assert [each.size for each in found] == sorted((each.size for each in found), reverse=True)
    assert [each.max_error for each in curve(1.0, _sized, (0.3, 0.1))] == [0.1, 0.3]


@pytest.mark.parametrize("sized", [_sized, _with_meshes])
@pytest.mark.parametrize("share", [3e-6, 1e-4, 0.02])
def test_the_smallest_bound_that_fits(share: float, sized: Callable[[float], RatePoint]) -> None:
    """However few bytes of the file are animation."""
    limit = sized(share * DIAGONAL).size
    found = smallest_error(limit, DIAGONAL, sized)
    assert found is not None
    assert found.size <= limit
    assert share * 0.995 <= found.max_error / DIAGONAL <= 1.03 * share


def test_without_error_where_that_fits() -> None:
    asked: list[float] = []

    def tried(max_error: float) -> RatePoint:
        asked.append(max_error)
        return _sized(max_error)

    found = smallest_error(10**6, DIAGONAL, tried)
    assert (found, asked) == (_sized(0.0), [0.0])


def test_nothing_fits_too_few_bytes() -> None:
    assert smallest_error(_sized(MAX_BOUND_PER_DIAGONAL * DIAGONAL).size - 1, DIAGONAL, _sized) is None
    assert smallest_error(_sized(MAX_BOUND_PER_DIAGONAL * DIAGONAL).size, DIAGONAL, _sized) is not None
    assert ERROR_FRACTIONS[0] > MIN_BOUND_PER_DIAGONAL


def test_what_is_given_back_was_tried_and_fits_though_sizes_are_noisy() -> None:
    tried: list[RatePoint] = []

    def noisy(max_error: float) -> RatePoint:
        plain = _sized(max_error)
        tried.append(RatePoint(max_error, plain.size + (37 * len(tried)) % 90, max_error))
        return tried[-1]

    found = smallest_error(2400, DIAGONAL, noisy)
    assert found in tried
    assert found is not None
    assert found.size <= 2400


@pytest.mark.parametrize("share", [3e-6, 1e-4, 1e-3, 0.02, 0.09])
def test_few_searches_find_the_bound(share: float) -> None:
    """Bisection took 11 for any of these."""
    asked: list[float] = []

    def tried(max_error: float) -> RatePoint:
        asked.append(max_error)
        return _sized(max_error)

    smallest_error(_sized(share * DIAGONAL).size, DIAGONAL, tried)
    assert len(asked) <= 8
