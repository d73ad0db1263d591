"""Tracks laid end to end, sampled together: the same as one by one."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from anim.sampling import batch as module
from anim.sampling.batch import concatenate
from anim.sampling.track import sample
from tests import clips
from tests.anim.operations.tracks import TRACKS
from tests.clips import CUBICSPLINE

SINGLE = clips.track("translation", [2.0], [[1.0, 2.0, 3.0]])
WEIGHTS = clips.track("weights", [0.0, 1, 2], np.array([[0, 1], [1, 0], [1, 1]]))
ALL = [*TRACKS.values(), SINGLE, WEIGHTS, *TRACKS.values()]


@pytest.mark.parametrize("limit", [1, 5, 4096])
def test_each_track_is_sampled_at_its_own_times_as_it_is_alone(limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_GROUP_KEYS", limit)
    rng = np.random.default_rng(3)
    at = np.column_stack((rng.uniform(-1, 4, (len(ALL), 5)), np.full(len(ALL), 1.25)))  # before, after, and on a key
    seen = []
    for group in concatenate(ALL):
        values = group.sample(at[group.numbers])
        for i, number in enumerate(group.numbers.tolist()):
            assert group.tracks[i] is ALL[number]
            np.testing.assert_allclose(values[i], sample(ALL[number], at[number]), rtol=0, atol=1e-15)
            seen.append(number)
    assert sorted(seen) == list(range(len(ALL)))


def test_keys_are_searched_as_they_are_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compared with every time, a million keys and 600 times would take 5 GB."""
    rng = np.random.default_rng(4)
    at = np.column_stack((rng.uniform(-1, 4, (len(ALL), 50)), np.full(len(ALL), 1.25)))
    compared = [group.sample(at[group.numbers]) for group in concatenate(ALL)]
    monkeypatch.setattr(module, "MAX_COMPARED_PER_TRACK", 0)
    searched = [group.sample(at[group.numbers]) for group in concatenate(ALL)]
    assert [each.tobytes() for each in searched] == [each.tobytes() for each in compared]


def test_times_in_a_long_track_take_little_memory() -> None:
    times = np.arange(100_000.0)
    (group,) = concatenate([clips.track("translation", times, np.stack((times,) * 3, axis=1))])
    tracemalloc.start()
    try:
        values = group.sample(np.linspace(0, 1e5 - 1, 600)[None])
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    np.testing.assert_allclose(values[0, :, 0], np.linspace(0, 1e5 - 1, 600))
    assert peak < 10e6  # not keys × times


def test_tracks_lie_one_after_the_other_with_their_tangents() -> None:
    one = clips.track("scale", [0.0, 1], np.ones((2, 3)), CUBICSPLINE, tangents=(np.full((2, 3), 5.0), np.ones((2, 3))))
    other = clips.track("scale", [0.0, 2, 3], np.zeros((3, 3)), CUBICSPLINE, tangents=(np.ones((3, 3)),) * 2)
    (group,) = concatenate([one, other])
    assert group.counts.tolist() == [2, 3]
    assert group.starts.tolist() == [0, 2]
    assert group.times.tolist() == [0, 1, 0, 2, 3]
    assert group.values[:, 0].tolist() == [1, 1, 0, 0, 0]
    assert group.tangents is not None
    assert group.tangents[0][:, 0].tolist() == [5, 5, 1, 1, 1]


def test_no_tracks_are_no_groups() -> None:
    assert concatenate([]) == []
