"""The gate: what comes through is float64, of the named shape, finite and read-only."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim import arrays
from anim.errors import RangeError, ShapeError


@pytest.mark.parametrize("values", [[[0, 1, 2]], ((0, 1, 2),), np.array([[0, 1, 2]], np.int8), np.zeros((1, 3), "f4")])
def test_anything_with_numbers_becomes_float64(values: Any) -> None:
    found = arrays.as_floats(values, "K 3")
    assert found.dtype == np.float64
    assert found.tolist() == np.asarray(values).tolist()
    assert not found.flags.writeable


@pytest.mark.parametrize(
    ("shape", "good", "bad"),
    [
        ("K", [(0,), (4,)], [(), (4, 1)]),
        ("K 3", [(0, 3), (2, 3)], [(3,), (2, 4), (3, 2), (1, 2, 3)]),
        ("F N 4", [(1, 2, 4), (0, 0, 4)], [(2, 4), (1, 2, 3)]),
        ("3 3", [(3, 3)], [(3, 4), (4, 3)]),
        ("", [()], [(1,)]),
    ],
)
def test_shapes(shape: str, good: list[tuple[int, ...]], bad: list[tuple[int, ...]]) -> None:
    for each in good:
        arrays.check_shape(np.zeros(each), shape)
    for each in bad:
        with pytest.raises(ShapeError, match="values has shape"):
            arrays.check_shape(np.zeros(each), shape, name="values")


@pytest.mark.parametrize("values", [["a"], [None, "b"], [[1], [1, 2]], [1j], np.array([1j]), {"a": 1}, ["1"], [b"1"]])
def test_what_is_no_number_is_refused(values: Any) -> None:
    with pytest.raises(ShapeError):
        arrays.as_floats(values, "K")


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_the_first_number_that_is_not_finite_is_named(bad: float) -> None:
    values: list[list[float]] = [[1, 2], [bad, bad]]
    with pytest.raises(RangeError, match=r"values holds -?(nan|inf) at \[1, 0\]"):
        arrays.as_floats(values, "K 2", name="values")


@pytest.mark.parametrize("values", [[3.4e38, 3.4e38], [1e150, -1e150], [5e-324], [1e308] * 3, [1e200] * 10_000])
def test_large_and_small_numbers_are_finite(values: list[float]) -> None:
    assert arrays.as_floats(values, "K").tolist() == values


def test_times_by_hand() -> None:
    assert arrays.as_key_times([0, 0.5, 2]).tolist() == [0, 0.5, 2]
    assert arrays.as_key_times([3.0]).tolist() == [3.0]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([], "empty"),
        ([-0.5, 1], r"start at -0.5 s"),
        ([0, 1, 1], r"not increasing at key 2 \(1 s after 1 s\)"),
        ([0, 2, 1, 0], r"not increasing at key 2 \(1 s after 2 s\)"),
        ([0, float("nan")], "nan"),
    ],
)
def test_times_that_can_not_be_are_refused(values: list[float], message: str) -> None:
    with pytest.raises(RangeError, match=message):
        arrays.as_key_times(values)


def test_checked_times_are_the_same_object_again() -> None:
    once = arrays.as_key_times([0, 1, 2])
    assert arrays.as_key_times(once) is once


def test_a_frozen_array_has_no_writable_memory() -> None:
    mine = np.zeros((3, 2))
    assert arrays.freeze(mine[:, 0]).base is mine
    with pytest.raises(ValueError, match="read-only"):
        mine[0] = 1


@pytest.mark.parametrize("gate", [lambda mine: arrays.as_floats(mine, "K"), arrays.as_key_times])
def test_later_writes_of_the_owner_change_nothing(gate: Any) -> None:
    mine = np.arange(3.0)
    found = gate(mine)
    mine[:] = 9
    assert found.tolist() == [0, 1, 2]


@pytest.mark.parametrize("gate", [lambda mine: arrays.as_floats(mine, "K"), arrays.as_key_times, arrays.own])
def test_later_writes_through_the_array_of_a_view_change_nothing(gate: Any) -> None:
    mine = np.arange(3.0)
    view = mine.view()
    view.flags.writeable = False
    found = gate(view)
    mine[:] = 9
    assert found.tolist() == [0, 1, 2]


def test_what_is_read_only_already_is_shared() -> None:
    mine = arrays.freeze(np.arange(3.0))
    assert arrays.as_floats(mine, "K") is mine


def test_indices_are_grouped_in_the_order_of_first_keys() -> None:
    assert list(arrays.group_indices("bcab").items()) == [("b", [0, 3]), ("c", [1]), ("a", [2])]
    assert arrays.group_indices([]) == {}


def test_objects_as_keys_are_equal_to_themselves_only() -> None:
    a, b = np.zeros(2), np.zeros(2)
    found = {arrays.Identity(a, None): "a", arrays.Identity(b, None): "b", arrays.Identity(a): "one"}
    assert [found[arrays.Identity(*each)] for each in ((a, None), (b, None), (a,))] == ["a", "b", "one"]
    assert arrays.Identity(a) != arrays.Identity(a.copy())
    assert arrays.Identity(a) != a.tolist()
