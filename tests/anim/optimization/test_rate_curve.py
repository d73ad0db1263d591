"""Rate curve: likely sizes and bounds between measured points, and beyond them."""

from __future__ import annotations

import pytest

from anim.optimization.rate_curve import MAX_EXPONENT, RateCurve
from anim.optimization.rate_distortion import (
    BOUND_EXPONENT_PER_SIZE,
    BOUND_STEP_FACTOR,
    MAX_STEP_FACTOR,
    RatePoint,
)

DIAGONAL = 3.0
BOUNDS = (1e-2, 1e-4, 1e-3)


def _curve(exponent: float) -> RateCurve:
    """Bytes as bound^(-1 / exponent) at three points."""
    return RateCurve([RatePoint(bound, 0, bound, round(1e6 * bound ** (-1 / exponent))) for bound in BOUNDS])


@pytest.mark.parametrize("exponent", [3, 8, 20])
@pytest.mark.parametrize(("low", "high"), [(1e-4, 1e-2), (3e-4, 5e-4), (5e-4, 5e-3)])
def test_sizes_between_points(exponent: float, low: float, high: float) -> None:
    curve = _curve(exponent)
    ratio = (high / low) ** (-1 / exponent)
    assert curve.size_at(1000, low, high) == pytest.approx(1000 * ratio, rel=1e-4)
    assert curve.size_at(1000 * ratio, high, low) == pytest.approx(1000, rel=1e-4)
    assert curve.size_at(1000, low, low) == pytest.approx(1000)


def test_sizes_beyond_the_points_and_without_any() -> None:
    beyond = 2 ** (-1 / BOUND_EXPONENT_PER_SIZE)
    for curve in (_curve(8), RateCurve([]), RateCurve([RatePoint(0.0, 0, 0.0, 9999)])):
        assert curve.size_at(1000, 2.0, 4.0) == pytest.approx(1000 * beyond)
        assert curve.size_at(1000, 1e-6, 2e-6) == pytest.approx(1000 * beyond)
        assert curve.size_at(1000, 0.0, 4.0) == 1000


def test_sizes_that_do_not_fall_are_taken_to_fall_slowly() -> None:
    """A fast search at a larger bound takes more bytes now and then."""
    curve = RateCurve([RatePoint(1e-3, 0, 0.0, 1000), RatePoint(1e-2, 0, 0.0, 1010)])
    assert curve.size_at(1000, 1e-3, 1e-2) == pytest.approx(1000 * 10 ** (-1 / MAX_EXPONENT))


@pytest.mark.parametrize("excess", [0.97, 1.0, 1.02, 1.1])
def test_a_bound_is_where_the_bytes_fit(excess: float) -> None:
    curve = _curve(8)
    bound = curve.bound_for(excess, 1e-3, DIAGONAL)
    wanted = 1e-3 * excess**8
    assert wanted * (1 - 1e-6) <= bound <= wanted * BOUND_STEP_FACTOR
    assert curve.size_at(1000 * excess, 1e-3, bound) <= 1000 * (1 + 1e-6)


def test_a_bound_follows_the_curve_across_a_point() -> None:
    """Steep up to 1e-3, flat from there: a bound beyond the point is larger than the first part says."""
    curve = RateCurve([RatePoint(1e-4, 0, 0, 2000), RatePoint(1e-3, 0, 0, 1000), RatePoint(1e-2, 0, 0, 900)])
    assert 1.15e-3 < curve.bound_for(1.08, 8e-4, DIAGONAL) < 1.4e-3
    assert curve.bound_for(1.08, 2e-4, DIAGONAL) < 3e-4


def test_a_bound_is_at_most_a_step_away() -> None:
    curve = _curve(8)
    assert curve.bound_for(100, 1e-3, DIAGONAL) <= 1e-3 * MAX_STEP_FACTOR * BOUND_STEP_FACTOR
    assert curve.bound_for(0.01, 1e-3, DIAGONAL) >= 1e-3 / MAX_STEP_FACTOR
