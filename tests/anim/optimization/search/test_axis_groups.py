"""Groups of tracks with a time axis each: counts by hand, and the best of all partitions of few tracks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from anim.arrays import Ints
from anim.optimization.search.axis_groups import group_tracks, num_keys

AXIS_BYTES, TIME_BYTES = 120.0, 4.0
KEY_BYTES = np.array([8.0, 8, 12, 8, 8])


def _random_reach(seed: int, tracks: int = 5, count: int = 30) -> Ints:
    """For each key one of the next ones, never before that of the key before."""
    steps = np.random.default_rng(seed).integers(1, 9, (tracks, count))
    return np.minimum(np.maximum.accumulate(np.arange(count) + steps, axis=1), count - 1)


def _groups(*reaches: Ints) -> list[list[list[int]]]:
    asked = [(each, KEY_BYTES[: len(each)]) for each in reaches]
    found = group_tracks(asked, axis_bytes=AXIS_BYTES, time_bytes=TIME_BYTES)
    return [[group.tolist() for group in some] for some in found]


def _num_keys(reach: Ints) -> Ints:
    return num_keys(reach, np.array(reach.shape[-1] - 1))


def _bytes(reach: Ints, groups: list[list[int]]) -> float:
    counts: list[int] = _num_keys(np.array([reach[each].min(axis=0) for each in groups])).tolist()
    widths = [float(KEY_BYTES[each].sum()) for each in groups]
    return sum(AXIS_BYTES + n * (TIME_BYTES + width) for n, width in zip(counts, widths, strict=True))


def _partitions(items: list[int]) -> Iterator[list[list[int]]]:
    if not items:
        yield []
        return
    for rest in _partitions(items[1:]):
        yield [[items[0]], *rest]
        for n, each in enumerate(rest):
            yield [*rest[:n], [items[0], *each], *rest[n + 1 :]]


def test_keys_from_the_first_to_the_last() -> None:
    reach = np.array([[1, 3, 3, 3], [3, 3, 3, 3], [1, 2, 3, 3]])
    assert _num_keys(reach).tolist() == [3, 2, 4]
    assert _num_keys(reach[:, None]).tolist() == [[3], [2], [4]]
    assert _num_keys(np.zeros((1, 1), np.int64)).tolist() == [1]
    assert num_keys(reach, np.array([1, 3, 2])).tolist() == [2, 2, 3]


def test_tracks_with_equal_keys_share_an_axis() -> None:
    reach = np.repeat(_random_reach(0, tracks=1), 5, axis=0)
    ((group,),) = _groups(reach)
    assert sorted(group) == [0, 1, 2, 3, 4]


def test_a_track_with_few_keys_stays_apart_from_one_with_many() -> None:
    every = np.minimum(np.arange(400) + 1, 399)
    reach = np.stack((every, np.full(400, 399), every, np.full(400, 399), every))
    (groups,) = _groups(reach)
    assert sorted(map(sorted, groups)) == [[0, 2, 4], [1, 3]]


@pytest.mark.parametrize("seed", range(20))
def test_groups_are_nearly_the_best_of_all_partitions(seed: int) -> None:
    reach = _random_reach(seed)
    (groups,) = _groups(reach)
    assert sorted(i for each in groups for i in each) == [0, 1, 2, 3, 4]
    found = _bytes(reach, groups)
    assert found <= _bytes(reach, [[i] for i in range(5)])
    assert found <= 1.05 * min(_bytes(reach, each) for each in _partitions([0, 1, 2, 3, 4]))


def test_groups_of_a_clip_do_not_depend_on_other_clips() -> None:
    """Of other numbers of tracks and keys, some at once and more than memory allows."""
    reaches = [_random_reach(seed, 1 + seed % 5, 1 + (7 * seed) % 400) for seed in range(300)]
    assert _groups(*reaches) == [_groups(each)[0] for each in reaches]
