"""Shared time axes, against the bytes of every way to share them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from anim.arrays import Bools, Floats
from anim.optimization.search import axis_merging
from anim.optimization.search.axis_merging import SharedAxis, merge_axes
from tests.calls import count_calls

AXIS, TIME = 120.0, 4.0


def _cost(keep: Bools, key_bytes: Floats, groups: Sequence[Sequence[int]]) -> float:
    """Bytes of groups of tracks, each on the keys that any of its members needs."""
    total = 0.0
    for group in groups:
        keys = sum(any(keep[i, k] for i in group) for k in range(keep.shape[1]))
        total += AXIS + keys * (TIME + sum(key_bytes[i] for i in group))
    return total


def _partitions(items: list[int]) -> Iterator[list[list[int]]]:
    if not items:
        yield []
        return
    first, rest = items[0], items[1:]
    for parts in _partitions(rest):
        yield [[first], *parts]
        for i in range(len(parts)):
            yield [*parts[:i], [first, *parts[i]], *parts[i + 1 :]]


def _random(seed: int, tracks: int, keys: int = 40) -> tuple[Bools, Floats]:
    rng = np.random.default_rng(seed)
    keep = rng.random((tracks, keys)) < rng.uniform(0.05, 0.9, (tracks, 1))
    keep[:, [0, -1]] = True
    return keep, rng.choice([8.0, 12.0], tracks)


def _merged(keep: Bools, key_bytes: Floats) -> list[SharedAxis]:
    (axes,) = merge_axes([(keep, key_bytes)], axis_bytes=AXIS, time_bytes=TIME)
    return axes


@pytest.mark.parametrize("seed", range(25))
def test_every_track_once_on_the_keys_that_its_axis_needs(seed: int) -> None:
    keep, key_bytes = _random(seed, 9)
    axes = _merged(keep, key_bytes)
    assert sorted(i for axis in axes for i in axis.members) == list(range(9))
    for axis in axes:
        assert (axis.keys == keep[list(axis.members)].any(axis=0)).all()


@pytest.mark.parametrize("seed", range(25))
def test_no_two_axes_are_left_that_would_save_bytes(seed: int) -> None:
    keep, key_bytes = _random(seed, 9)
    groups = [list(axis.members) for axis in _merged(keep, key_bytes)]
    cost = _cost(keep, key_bytes, groups)
    assert cost <= _cost(keep, key_bytes, [[i] for i in range(9)])
    for a in range(len(groups)):
        for b in range(a):
            others = [group for i, group in enumerate(groups) if i not in (a, b)]
            assert _cost(keep, key_bytes, [*others, groups[a] + groups[b]]) >= cost


@pytest.mark.parametrize("seed", range(25))
def test_near_the_best_of_all_ways(seed: int) -> None:
    keep, key_bytes = _random(seed, 5)
    cost = _cost(keep, key_bytes, [list(axis.members) for axis in _merged(keep, key_bytes)])
    best = min(_cost(keep, key_bytes, groups) for groups in _partitions(list(range(5))))
    assert best <= cost <= 1.05 * best


def _plain(keep: Bools, key_bytes: Floats) -> list[list[int]]:
    """Groups of tracks, by loops: the pair that saves most is merged, the first of equal ones."""
    groups: list[list[int]] = []
    for i in range(len(keep)):
        equal = next((group for group in groups if (keep[group[0]] == keep[i]).all()), None)
        groups.append([i]) if equal is None else equal.append(i)
    while True:
        cost = _cost(keep, key_bytes, groups)
        tried = [
            (cost - _cost(keep, key_bytes, [*groups[:a], groups[a] + groups[b], *groups[a + 1 : b], *groups[b + 1 :]]),
             -a, -b)
            for b in range(len(groups)) for a in range(b)
        ]  # fmt: skip
        saved, a, b = max(tried, default=(0.0, 0, 0))
        if saved <= 0:
            return groups
        groups[-a] = groups[-a] + groups.pop(-b)


def _several() -> list[tuple[Bools, Floats]]:
    return [_random(seed, tracks, keys) for seed, (tracks, keys) in enumerate([(9, 40), (1, 7), (30, 60), (4, 200)])]


def test_axes_are_those_of_a_plain_loop() -> None:
    for keep, key_bytes in (*_several()[:2], _random(5, 12, 30), _random(6, 12, 90)):
        assert [list(axis.members) for axis in _merged(keep, key_bytes)] == _plain(keep, key_bytes)


@pytest.mark.parametrize(("pairs", "calls"), [(1, 4), (170, 3), (axis_merging.MAX_STACKED_PAIRS, 1)])
def test_axes_of_clips_together_are_those_of_each_alone(
    pairs: int, calls: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also in parts, where all together would take too much memory."""
    alone = [_merged(*each) for each in _several()]
    assert any(1 < len(axes) < 30 for axes in alone)
    monkeypatch.setattr(axis_merging, "MAX_STACKED_PAIRS", pairs)
    counted = count_calls(monkeypatch, axis_merging, "_Merging")
    together = merge_axes(_several(), axis_bytes=AXIS, time_bytes=TIME)
    assert len(counted) == calls
    for some, axes in zip(together, alone, strict=True):
        assert [axis.members for axis in some] == [axis.members for axis in axes]
        assert all((a.keys == b.keys).all() and a.keys.shape == b.keys.shape for a, b in zip(some, axes, strict=True))


def test_two_tracks_merge_just_where_it_pays() -> None:
    """Sharing saves an axis, 120 bytes, and a time per shared key; it costs a value where one has no key."""
    keep = np.zeros((2, 100), np.bool_)
    keep[:, [0, -1]] = True
    for more in range(1, 40):
        keep[0, more] = True
        saved = AXIS + 2 * TIME - more * 12.0
        assert len(_merged(keep, np.array([8.0, 12.0]))) == (1 if saved > 0 else 2), more


def test_equal_needs_share_whatever_they_cost() -> None:
    keep = np.tile([True, False, True], (4, 1))
    ((axis,),) = merge_axes([(keep, np.full(4, 1e9))], axis_bytes=0.0, time_bytes=0.0)
    assert (axis.members, axis.keys.tolist()) == ((0, 1, 2, 3), [True, False, True])
