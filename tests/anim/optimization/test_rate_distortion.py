"""Size against error: bounds of a curve, and the smallest one that fits."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace

import pytest

from anim.optimization.rate_distortion import (
    ERROR_FRACTIONS,
    FIRST_FRACTION,
    MAX_BOUND_PER_DIAGONAL,
    MIN_BOUND_PER_DIAGONAL,
    RatePoint,
    bound_between,
    curve,
    next_bound,
    smallest_bound,
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
@pytest.mark.parametrize("ratio", [1.0, 0.98])
@pytest.mark.parametrize("share", [3e-6, 1e-4, 7e-4, 0.02])
def test_the_smallest_bound_that_fits(share: float, ratio: float, sized: Callable[[float], RatePoint]) -> None:
    """However few bytes of the file are animation, and if the full search saves some of them."""

    def full(max_error: float) -> float:
        point = sized(max_error)
        return point.size - (1 - ratio) * point.animation

    limit = math.ceil(full(share * DIAGONAL))
    found = smallest_bound(limit, DIAGONAL, sized, ratio=ratio)
    assert found is not None
    assert full(found) <= limit
    assert share * 0.995 <= found / DIAGONAL <= 1.12 * share


def test_without_error_where_that_fits() -> None:
    asked: list[float] = []

    def tried(max_error: float) -> RatePoint:
        asked.append(max_error)
        return _sized(max_error)

    assert smallest_bound(10**6, DIAGONAL, tried) == 0
    assert sorted(asked) == pytest.approx([0.0, FIRST_FRACTION * DIAGONAL])


def test_nothing_fits_too_few_bytes() -> None:
    smallest = _sized(MAX_BOUND_PER_DIAGONAL * DIAGONAL).size
    assert smallest_bound(smallest - 1, DIAGONAL, _sized) is None
    assert smallest_bound(smallest, DIAGONAL, _sized) == pytest.approx(MAX_BOUND_PER_DIAGONAL * DIAGONAL)
    assert smallest_bound(1000, 0.0, _sized) is None
    assert ERROR_FRACTIONS[0] > MIN_BOUND_PER_DIAGONAL


@pytest.mark.parametrize("ratio", [1.0, 0.98])
def test_fewer_bytes_at_small_bounds_are_not_believed(ratio: float) -> None:
    """A quick search without verification can miss bounds near what float32 stores, in fewer bytes."""

    def missed(max_error: float) -> RatePoint:
        size = 2000 if 0 < max_error < 5e-5 * DIAGONAL else _sized(max_error).size
        return RatePoint(max_error, size, max_error, size)

    limit = math.ceil(ratio * _sized(1.2e-4 * DIAGONAL).size)
    found = smallest_bound(limit, DIAGONAL, missed, ratio=ratio)
    assert found is not None
    assert 1e-4 <= found / DIAGONAL <= 1.5e-4


@pytest.mark.parametrize("ratio", [1.0, 0.97])
def test_more_bytes_never_give_a_larger_bound(ratio: float) -> None:
    """Though sizes are noisy: by 9 %, far more than those of real files."""

    def noise(max_error: float) -> float:
        return random.Random(f"{max_error:.6g}").random()

    def noisy(max_error: float) -> RatePoint:
        plain = _sized(max_error)
        size = round(plain.size * (1 + 0.09 * noise(max_error)))
        return RatePoint(max_error, size, max_error, size - 300)

    found = [smallest_bound(limit, DIAGONAL, noisy, ratio=ratio) or math.inf for limit in range(1400, 4200, 3)]
    assert found == sorted(found, reverse=True)
    assert len(set(found)) > 30


@pytest.mark.parametrize("share", [3e-6, 1e-4, 1e-3, 0.02, 0.09])
def test_few_searches_find_the_bound(share: float) -> None:
    asked: list[float] = []

    def tried(max_error: float) -> RatePoint:
        asked.append(max_error)
        return _sized(max_error)

    smallest_bound(_sized(share * DIAGONAL).size, DIAGONAL, tried)
    assert len(asked) == len(set(asked)) <= 8


def test_the_next_bound_follows_from_the_bytes_too_many() -> None:
    bound = 1e-3 * DIAGONAL
    near = next_bound(bound, DIAGONAL, RatePoint(bound, 2001, bound, 1500), 2000)
    far = next_bound(bound, DIAGONAL, RatePoint(bound, 2030, bound, 1500), 2000)
    assert 1.04 * bound < near < far < 1.6 * bound
    assert next_bound(bound, DIAGONAL, RatePoint(bound, 9000, bound, 1500), 2000) < 4.3 * bound
    assert next_bound(0.0, DIAGONAL, RatePoint(0.0, 2001, 0.0, 1500), 2000) > 0


def test_bounds_between_two_come_to_an_end() -> None:
    low, high, tried = 1e-3 * DIAGONAL, 1.8e-3 * DIAGONAL, 0
    while (bound := bound_between(low, high, DIAGONAL)) is not None:
        assert low < bound < high
        high, tried = bound, tried + 1
    assert 2 <= tried <= 5
    assert bound_between(0.0, high, DIAGONAL) is None
