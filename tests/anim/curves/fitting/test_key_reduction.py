"""Greedy segments and needed keys, against plain loops over one key and one track at a time."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anim.arrays import Bools, Floats, Ints
from anim.curves.fitting import key_reduction
from anim.curves.fitting.key_reduction import (
    greedy_indices,
    greedy_keys,
    greedy_segments,
    joint_greedy_keys,
)

RNG = np.random.default_rng(5)


def _missed(values: Floats, times: Floats, keep: Bools) -> float:
    """How far lines between the kept keys are off, at most."""
    lines = [np.interp(times, times[keep], column[keep]) for column in values.T]
    return float(np.linalg.norm(np.transpose(lines) - values, axis=1).max())


def _ends(count: int) -> Bools:
    ends = np.zeros(count, np.bool_)
    ends[0] = ends[-1] = True
    return ends


def _longest(values: Floats, times: Floats) -> Bools:
    """Greedy longest segments by trying one key after the other."""
    keep, start, last = np.zeros(len(times), np.bool_), 0, len(times) - 1
    keep[0] = True
    while start < last:
        end = start + 1
        while end < last and _missed(values[start : end + 2], times[start : end + 2], _ends(end + 2 - start)) <= 1:
            end += 1
        keep[end], start = True, end
    return keep


def _fewest(values: Floats, times: Floats) -> int:
    """The fewest keys of all choices that miss nothing by over 1, by dynamic programming."""
    count = [1] + [len(times)] * (len(times) - 1)
    for end in range(1, len(times)):
        for start in range(end):
            part = slice(start, end + 1)
            if _missed(values[part], times[part], _ends(end + 1 - start)) <= 1:
                count[end] = min(count[end], count[start] + 1)
    return count[-1]


@given(st.integers(0, 2**32 - 1), st.integers(2, 60), st.floats(0.05, 20))
def test_lines_between_kept_keys_miss_nothing(seed: int, count: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    values = np.cumsum(size * rng.normal(size=(4, count, 3)), axis=1)
    times = np.cumsum(rng.uniform(0.01, 1, count))
    keep = greedy_keys(values, times)
    assert keep[:, [0, -1]].all()
    for track in range(4):
        assert _missed(values[track], times, keep[track]) <= 1 + 1e-9
    joint = joint_greedy_keys(values, times)
    assert joint[[0, -1]].all()
    assert max(_missed(each, times, joint) for each in values) <= 1 + 1e-9


def test_every_track_as_if_it_were_alone() -> None:
    values = np.cumsum(RNG.normal(size=(20, 120, 4)), axis=1)
    times = np.arange(120.0)
    together = greedy_keys(values, times)
    for track in range(20):
        assert (greedy_keys(values[track : track + 1], times)[0] == together[track]).all()
        assert (joint_greedy_keys(values[track : track + 1], times) == together[track]).mean() > 0.8


@pytest.mark.parametrize("power", [2, 3])
def test_bows_take_the_longest_segments(power: int) -> None:
    """On a bow, what a line misses grows with its length: trying key after key finds the same ones."""
    times = np.linspace(0, 1, 200)
    values = (80 * times**power)[:, None]
    expected = _longest(values, times)
    assert 4 < expected.sum() < 20
    assert (greedy_keys(values[None], times)[0] == expected).all()
    assert (joint_greedy_keys(values[None], times) == expected).all()


def test_corners_of_straight_tracks() -> None:
    times = np.array([0, 0.1, 0.5, 1, 1.5, 3, 3.5, 4])
    zigzag = np.interp(times, [0, 1, 3, 4], [0, 50, -50, 0])[:, None]
    line = (7 * times)[:, None]
    keep = greedy_keys(np.stack((zigzag, line)), times)
    assert times[keep[0]].tolist() == [0, 1, 3, 4]
    assert times[keep[1]].tolist() == [0, 4]
    assert times[joint_greedy_keys(np.stack((zigzag, line)), times)].tolist() == [0, 1, 3, 4]


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_not_many_more_than_the_fewest(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.5, 1, 25))
    values = np.cumsum(rng.normal(size=(1, 25, 2)), axis=1)
    kept = int(greedy_keys(values, times).sum())
    assert _fewest(values[0], times) <= kept <= 2 * _fewest(values[0], times)


@pytest.mark.parametrize("count", [1, 2])
def test_one_and_two_keys_stay(count: int) -> None:
    assert greedy_keys(np.zeros((3, count, 3)), np.arange(float(count))).all()
    assert joint_greedy_keys(np.zeros((3, count, 3)), np.arange(float(count))).all()


def test_no_tracks() -> None:
    assert greedy_keys(np.zeros((0, 9, 4)), np.arange(9.0)).shape == (0, 9)


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


def test_one_and_two_keys_stay_as_indices() -> None:
    for count in (1, 2):
        assert greedy_indices(count, lambda start, end: False).tolist() == [*range(count)]


def test_parts_of_long_tracks_are_searched_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many calls as for one part, and the keys of each part by itself."""
    monkeypatch.setattr(key_reduction, "KEYS_PER_PART", 300)
    count, calls = 1000, 0
    ends = [0, 300, 600, 900, 999]
    wanted = RNG.random((2, count)) < 0.1

    def fits(track: Ints, start: Ints, end: Ints) -> Bools:
        nonlocal calls
        calls += 1
        return np.array([not wanted[t, a + 1 : b].any() for t, a, b in zip(track, start, end, strict=True)])

    keep = greedy_segments(2, count, fits)
    assert calls < 300
    assert keep[:, ends].all()
    assert keep[wanted].all()
    values, times = np.cumsum(RNG.normal(size=(2, count, 1)), axis=1), np.arange(float(count))
    parts = [slice(start, end + 1) for start, end in pairwise(ends)]
    for search in (greedy_keys, lambda *keys: joint_greedy_keys(*keys)[None]):
        keep = search(values, times)
        assert all((keep[:, part] == search(values[:, part], times[part])).all() for part in parts)
