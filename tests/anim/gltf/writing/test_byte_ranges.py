"""Byte ranges against plain sets of byte numbers."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from anim.gltf.writing.byte_ranges import OffsetMap, Range, aligned, all_dropped, difference, union

LENGTH = 60
RANGES = st.lists(st.tuples(st.integers(0, LENGTH), st.integers(0, LENGTH)), max_size=8)


def _bytes(ranges: list[Range]) -> set[int]:
    return {byte for start, end in ranges for byte in range(start, end)}


def _check_tidy(ranges: list[Range]) -> None:
    """Sorted, none empty, none touching the next."""
    assert all(start < end for start, end in ranges)
    assert all(a[1] < b[0] for a, b in pairwise(ranges))


def test_by_hand() -> None:
    assert union([(5, 7), (0, 2), (2, 3), (6, 9), (4, 4)]) == [(0, 3), (5, 9)]
    assert difference([(0, 10)], [(2, 4)]) == [(0, 2), (4, 10)]
    assert aligned([(1, 12), (13, 15), (16, 20)]) == [(4, 12), (16, 20)]


@given(RANGES)
def test_union(ranges: list[Range]) -> None:
    found = union(ranges)
    assert _bytes(found) == _bytes(ranges)
    _check_tidy(found)


@given(RANGES, RANGES)
def test_difference(ranges: list[Range], without: list[Range]) -> None:
    found = difference(ranges, without)
    assert _bytes(found) == _bytes(ranges) - _bytes(without)
    _check_tidy(found)


@given(RANGES)
def test_aligned_keeps_the_whole_fours_inside(ranges: list[Range]) -> None:
    inside = union(ranges)
    fours = {i for i in range(0, LENGTH, 4) if any(start <= i and i + 4 <= end for start, end in inside)}
    assert _bytes(aligned(inside)) == {i + k for i in fours for k in range(4)}


@given(RANGES)
def test_shift_says_where_every_byte_goes(dropped: list[Range]) -> None:
    shift = OffsetMap(dropped)
    gone = _bytes(dropped)
    assert shift.dropped_bytes == len(gone)
    for at in range(LENGTH + 1):
        assert shift(at) == len([i for i in range(at) if i not in gone])


@given(RANGES, RANGES)
def test_ranges_dropped_one_after_another(first: list[Range], then: list[Range]) -> None:
    """The second ones are of what is left."""
    left = sorted(set(range(2 * LENGTH)) - _bytes(first))
    found = all_dropped(union(first), then)
    _check_tidy(found)
    assert set(range(2 * LENGTH)) - _bytes(found) == {each for i, each in enumerate(left) if i not in _bytes(then)}
