"""TimeAxis: checked once, shared by reference."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from anim.errors import RangeError
from anim.model import Clip, TimeAxis
from anim.model.time_axis import as_time_axis, merge_times
from anim.model.track import share_time_axes
from tests.clips import track

ONES = np.ones((2, 3))


def test_times_are_read_only_and_independent_of_their_source() -> None:
    given = np.array([0, 1])
    axis = TimeAxis(given)
    given[0] = 1
    assert axis.times.tolist() == [0, 1]
    assert len(axis) == 2
    with pytest.raises(ValueError, match="read-only"):
        axis.times[0] = 2
    with pytest.raises(FrozenInstanceError):
        axis.times = axis.times  # type: ignore[misc]
    with pytest.raises(RangeError, match="not increasing at key 1"):
        TimeAxis([1, 1])


def test_tracks_share_an_axis_by_reference() -> None:
    first = track("scale", [0, 1], ONES)
    second = first.with_keys(first.time_axis, 2 * ONES)
    third = replace(first, node=1)
    assert first.time_axis is second.time_axis is third.time_axis
    assert as_time_axis(first.time_axis) is first.time_axis
    assert Clip("", (first, third)).time_axes == (first.time_axis,)


def test_equal_tracks_may_have_their_own_axes() -> None:
    first, second = track("scale", [0, 1], ONES), track("scale", [0, 1], ONES, node=1)
    assert first == replace(second, node=0)
    clip = Clip("", (first, second))
    assert len(clip.time_axes) == 2
    assert len(Clip("", tuple(share_time_axes(clip.tracks))).time_axes) == 1


def test_shared_axes_stay_shared_and_read_only_in_copies() -> None:
    first = track("scale", [0, 1], ONES)
    one, other = pickle.loads(pickle.dumps((first, replace(first, node=1))))
    assert one == first
    assert one.time_axis is other.time_axis
    assert not one.times.flags.writeable


def test_key_times_of_all_axes() -> None:
    both = Clip("", (track("scale", [0.5, 1], ONES), track("scale", [0, 0.5], ONES, node=1)))
    assert both.key_times.tolist() == [0, 0.5, 1]
    assert Clip("", ()).key_times.tolist() == [0]
    assert merge_times([]).tolist() == []


def test_short_text() -> None:
    assert repr(TimeAxis([0, 0.5])) == "TimeAxis(keys=2, start_s=0, end_s=0.5)"
