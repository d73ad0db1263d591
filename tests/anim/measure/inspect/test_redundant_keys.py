"""Keys that can go: where they share a time axis, only if that saves bytes."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools
from anim.measure.inspect.redundant_keys import redundant_keys
from anim.model import Track
from tests.clips import track

RNG = np.random.default_rng(4)


def _track(times: np.ndarray, width: int = 3) -> Track:
    path = "translation" if width == 3 else "weights"
    return track(path, times, RNG.normal(size=(len(times), width)))


def _mask(keys: int, *given: int) -> np.ndarray:
    return np.isin(np.arange(keys), given)


def _counts(tracks: list[Track], given: dict[int, Bools]) -> list[int]:
    found = redundant_keys(tracks, given)
    return [int(found[i].sum()) if i in found else 0 for i in range(len(tracks))]


def test_alone_on_its_axis_every_key_that_is_given_goes() -> None:
    assert _counts([_track(np.arange(5.0))], {0: _mask(5, 1, 3)}) == [2]


def test_what_another_track_on_the_axis_needs_stays() -> None:
    """Two keys of 12 bytes don't pay for an axis of their own; the key that neither needs goes from both."""
    first = _track(np.arange(5.0))
    both = [first, track("scale", first.time_axis, first.values)]
    assert both[1].time_axis is first.time_axis
    assert _counts(both, {0: _mask(5, 1, 3), 1: _mask(5, 3)}) == [1, 1]
    assert _counts(both, {0: _mask(5, 1), 1: _mask(5, 3)}) == [0, 0]


def test_an_axis_of_its_own_where_it_costs_less_than_the_keys() -> None:
    """40 of 50 keys of 12 bytes: 480 bytes, for an axis of 10 keys and its JSON of 120 bytes; 10 keys are too few."""
    first = _track(np.arange(50.0))
    both = [first, track("scale", first.time_axis, first.values)]
    assert _counts(both, {0: _mask(50, *range(5, 45)), 1: _mask(50)}) == [40, 0]
    assert _counts(both, {0: _mask(50, *range(5, 15)), 1: _mask(50)}) == [0, 0]


def test_tracks_that_move_nothing_need_no_axis() -> None:
    first = _track(np.arange(5.0))
    both = [first, track("scale", first.time_axis, np.ones((5, 3)))]
    assert _counts(both, {0: _mask(5, 2)}) == [1, 0]
