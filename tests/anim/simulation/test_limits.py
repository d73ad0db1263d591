"""Limits of the quantities of simulations."""

from __future__ import annotations

import math

import pytest

from anim.errors import RangeError
from anim.simulation.limits import check_largest, check_range


@pytest.mark.parametrize("value", [0.0, 1.0, 2.0])
def test_both_ends_of_a_range_belong_to_it(value: float) -> None:
    check_range("drag", value, 0.0, 2.0)


@pytest.mark.parametrize("value", [-1e-9, 2.1, math.nan, math.inf, -math.inf, 10**30])
def test_numbers_outside_of_a_range_are_refused(value: float) -> None:
    with pytest.raises(RangeError, match=r"^`drag` is .* per second \(expected 0 to 2\)$"):
        check_range("drag", value, 0.0, 2.0, "per second")


def test_an_end_can_be_left_out() -> None:
    with pytest.raises(RangeError, match=r"^`mass` is 0 kg \(expected above 0, at most 5\)$"):
        check_range("mass", 0.0, 0.0, 5.0, "kg", is_above=True)
    with pytest.raises(RangeError, match="`step` is inf"):
        check_range("step", math.inf, 0.0, math.inf)


def test_the_largest_component_of_a_vector_counts() -> None:
    check_largest("wind", (3.0, -4.0, 0.0), 4.0, "m/s")
    with pytest.raises(RangeError, match=r"^`wind` is 4 m/s \(limit 3\)$"):
        check_largest("wind", (3.0, -4.0, 0.0), 3.0, "m/s")
    with pytest.raises(RangeError, match="`wind` is inf m/s"):
        check_largest("wind", (math.nan, 0.0, 0.0), 3.0, "m/s")
