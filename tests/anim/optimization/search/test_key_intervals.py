"""Key intervals of axes of several clips, against those of each axis by itself."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats
from anim.optimization.search.key_intervals import KeyIntervals, find_intervals
from anim.sampling.track import find_interval
from tests.anim.optimization.search.stacks import CLIPS, stack

STACKED = stack(*CLIPS)
CLIP_OF = np.array([2, 0, 1, 1, 0, 2])


def _axes() -> Bools:
    """Keys (A, G): all, the first alone, the last alone, every third, two inside, and some of the longest."""
    rng = np.random.default_rng(2)
    keys = np.zeros((len(CLIP_OF), STACKED.grid.shape[1]), np.bool_)
    sizes = [len(STACKED.sources[clip].grid) for clip in CLIP_OF.tolist()]
    keys[0, : sizes[0]] = True
    keys[1, 0] = True
    keys[2, sizes[2] - 1] = True
    keys[3, : sizes[3] : 3] = True
    keys[4, [2, 5]] = True
    keys[5] = rng.random(keys.shape[1]) < 0.3
    return keys


def test_intervals_are_those_of_each_axis_alone() -> None:
    """What linear interpolation of any keys shows is the same, at all times of the clip and after it."""
    keys = _axes()
    found = find_intervals(keys, STACKED, CLIP_OF)
    values: Floats = np.random.default_rng(3).normal(size=(keys.shape[1],))
    for axis, clip in enumerate(CLIP_OF.tolist()):
        grid, count = STACKED.grid[clip], int(keys[axis].sum())
        own, at = np.append(values[:count], 0.0), STACKED.at[clip]
        assert found.counts[axis] == count
        left, u = found.left[axis], found.u[axis]
        assert left.min() >= 0 <= u.min() <= u.max() <= 1
        assert left.max() <= max(count - 2, 0)
        place = find_interval(grid[keys[axis]], at)
        expected = (1 - place.u) * own[place.left] + place.u * own[place.right]
        np.testing.assert_allclose((1 - u) * own[left] + u * own[left + 1], expected, rtol=0, atol=1e-14)


def test_keys_are_at_their_times() -> None:
    keys = _axes()
    found = find_intervals(keys, STACKED, CLIP_OF)
    for axis, clip in enumerate(CLIP_OF.tolist()):
        times = STACKED.at[clip, found.at[axis]]
        count = int(keys[axis].sum())
        assert times[:count].tolist() == STACKED.grid[clip, keys[axis]].tolist()
        assert (found.at[axis, count:] == found.at[axis, count - 1]).all()
        assert found.is_key[axis].tolist() == [k < count for k in range(found.at.shape[1])]


def test_no_axes() -> None:
    found: KeyIntervals = find_intervals(_axes()[:0], STACKED, CLIP_OF[:0])
    assert [len(part) for part in found] == [0, 0, 0, 0]
