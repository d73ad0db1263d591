"""Greedy segments, against trying one key after the other."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from anim.arrays import Bools, Ints
from anim.curves.fitting.key_reduction import greedy_indices, greedy_segments


@given(st.lists(st.integers(1, 9), min_size=1, max_size=40))
def test_each_segment_is_the_longest_one(lengths: list[int]) -> None:
    """From key k, segments of up to lengths[k] intervals are within the tolerance."""
    last = len(lengths)
    expected = [0]
    while expected[-1] < last:
        expected.append(min(expected[-1] + lengths[expected[-1]], last))
    assert greedy_indices(last + 1, lambda start, end: end - start <= lengths[start]).tolist() == expected


def test_tracks_do_not_influence_each_other() -> None:
    limits = np.array((1, 3, 7))

    def fits(track: Ints, start: Ints, end: Ints) -> Bools:
        assert (end - start > 1).all()
        return np.asarray(end - start <= limits[track])

    keep = greedy_segments(3, 15, fits)
    assert [np.flatnonzero(row).tolist() for row in keep] == [[*range(15)], [0, 3, 6, 9, 12, 14], [0, 7, 14]]


def test_one_and_two_keys_stay() -> None:
    for count in (1, 2):
        assert greedy_indices(count, lambda start, end: False).tolist() == [*range(count)]
