"""Tracks laid end to end, sampled together: the same as one by one."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from anim.arrays import Floats, Ints
from anim.model import TimeAxis, Track
from anim.sampling import batch as module
from anim.sampling import lazy_batch, sample_pose
from anim.sampling.batch import MixedBatch, concatenate
from anim.sampling.lazy_batch import LazyBatch, batches
from anim.sampling.players import PLAYERS, sampler
from anim.sampling.track import KeyInterval, find_interval, sample
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


@pytest.mark.parametrize("shared", [True, False])
def test_intervals_are_found_once_per_axis_and_row(shared: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same as of every track by itself, also where axes or rows are shared."""
    axis = TimeAxis([0.0, 0.5, 2])
    axes = [axis] * 6 if shared else [TimeAxis([0.0, 0.5, 2 + n]) for n in range(6)]
    (group,) = concatenate([clips.track("translation", each, np.ones((3, 3))) for each in axes])
    at, rows = np.array([[-1, 0, 0.25, 2, 9], [0.5, 0.75, 1, 1, 3.0]]), np.array([0, 0, 1, 0, 1, 1])
    searched: list[int] = []  # number of axes, by call
    search = module._find_intervals

    def note(times: Floats, starts: Ints, counts: Ints, at: Floats) -> KeyInterval:
        searched.append(len(counts))
        return search(times, starts, counts, at)

    monkeypatch.setattr(module, "_find_intervals", note)
    found, expected = group.intervals_of_rows(at, rows), group.find_intervals(at[rows])
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)
    assert searched == [2 if shared else 6, 6]


@pytest.mark.parametrize("player", list(PLAYERS))
def test_players_sample_concatenated_tracks_as_single_ones(player: str) -> None:
    at = np.linspace(-1, 4, 33)
    used = sampler(player)
    for group in concatenate(ALL):
        times = np.tile(at, (len(group.tracks), 1))
        values = used(group, times, group.find_intervals(times))
        for i, each in enumerate(group.tracks):
            (single,) = batches([each])
            expected = used(single, at, find_interval(each.times, at))[:, 0]
            np.testing.assert_allclose(values[i], expected, rtol=0, atol=1e-15)


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


def test_tracks_are_divided_by_their_values(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wide ones, and those that become longer, fewer at a time; each once."""
    monkeypatch.setattr(lazy_batch, "MAX_DIVIDED_VALUES", 100)
    for width, keys, size in ((4, 0, 5), (20, 0, 1), (4, 10, 2), (300, 0, 1)):
        axis = TimeAxis(np.arange(5.0))
        tracks = [Track(i, "weights", "LINEAR", axis, np.zeros((5, width))) for i in range(7)]
        (lazy,) = lazy_batch.lazy_batches(tracks)
        parts = list(lazy.divide(keys))
        assert [len(part.tracks) for part in parts] == [size] * (7 // size) + [7 % size] * bool(7 % size)
        assert [n for part in parts for n in part.numbers.tolist()] == list(range(7))


@pytest.mark.parametrize("most", [1, 9, 40, 10**6])
def test_tracks_of_many_axes_are_grouped_by_size(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Long axes by themselves, short ones together: every track once, with the same values."""
    monkeypatch.setattr(lazy_batch, "MAX_STACKED_KEYS", most)
    monkeypatch.setattr(lazy_batch, "MAX_MIXED_KEYS", most // 4)
    moving = [
        clips.track("translation", np.arange(2 + n % 5) * (1.0 + n % 3), np.arange(3.0 * (2 + n % 5)).reshape(-1, 3))
        for n in range(20)
    ]
    single, mixed = lazy_batch.mixed_batches(moving)
    groups: list[LazyBatch | MixedBatch] = [*single, *mixed]
    numbers = np.concatenate([each.numbers for each in groups])
    assert sorted(numbers.tolist()) == list(range(20))
    assert all(sum(len(track.times) for track in each.tracks) <= most for each in mixed)
    assert bool(mixed) == (most > 1)
    for each in groups:
        assert all(track is moving[number] for track, number in zip(each.tracks, each.numbers.tolist(), strict=True))


@pytest.mark.parametrize("most", [1, 40])
def test_poses_do_not_depend_on_the_groups(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    moving = [
        clips.track(
            "translation",
            np.arange(2 + n % 5) * (1.0 + n % 3),
            np.random.default_rng(n).normal(size=(2 + n % 5, 3)),
            node=n,
        )
        for n in range(20)
    ]
    nodes, at = clips.skeleton([-1] * 20), np.linspace(-1, 9, 31)
    expected = sample_pose(nodes, clips.clip(*moving), at).translation
    monkeypatch.setattr(lazy_batch, "MAX_STACKED_KEYS", most)
    monkeypatch.setattr(lazy_batch, "MAX_MIXED_KEYS", most // 4)
    assert np.array_equal(sample_pose(nodes, clips.clip(*moving), at).translation, expected)
