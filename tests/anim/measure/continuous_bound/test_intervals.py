"""Gaps between the keys of two clips, and where they lie on one time axis."""

from __future__ import annotations

import numpy as np
import pytest

from anim.measure.continuous_bound.intervals import Intervals, interval_keys, merge_intervals
from tests.clips import clip, track


def test_keys_of_both_and_times_within_long_gaps() -> None:
    a = clip(track("translation", [0, 0.02, 0.04], np.zeros((3, 3))))
    b = clip(track("translation", [0, 0.04, 0.5], np.zeros((3, 3))))
    times = np.array([0, 0.01, 0.02, 0.03, 0.04, 0.2, 0.3, 0.5])
    found = merge_intervals(times, a, b)
    assert found.edges.tolist() == [0, 0.02, 0.04, 0.2, 0.3, 0.5]
    assert found.number(np.array([0, 0.01, 0.02, 0.3, 0.5])).tolist() == [0, 0, 1, 4, 4]
    assert len(found) == 5
    assert found.first.edges.tolist() == [0, 0.02]


def test_only_what_the_times_span() -> None:
    a = clip(track("translation", [0, 0.02, 0.04, 0.06], np.zeros((4, 3))))
    assert merge_intervals(np.array([0.01, 0.02, 0.03]), a).edges.tolist() == [0.01, 0.02, 0.03]


def test_places_before_between_and_after_keys() -> None:
    found = interval_keys(np.array([1.0, 2, 4]), Intervals(np.array([0.0, 1, 2, 3, 4, 5])))
    assert found.left.tolist() == [0, 0, 1, 1, 2]
    assert found.right.tolist() == [1, 1, 2, 2, 2]
    assert found.inside.tolist() == [False, True, True, True, False]
    assert found.start.tolist() == [0, 0, 0, 0.5, 0]
    assert found.end == pytest.approx([0, 1, 0.5, 1, 0])
