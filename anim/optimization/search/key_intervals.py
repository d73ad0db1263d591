"""Key intervals of all time axes of a trial, at the times it is measured at."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.optimization.search.stacked_clips import StackedClips


class KeyIntervals(NamedTuple):
    """Key intervals of A time axes at W times, and the places of their up to K keys.

    counts: (A,) keys. at: (A, K) indices of the keys among the times; after an axis' last key the last one again.
    left: (A, W) key at or before each time, at most the second to last. u: (A, W) interpolation parameter from there to
    the next key: 0 before the first key, 1 after the last, 0 with a single key.
    """

    counts: Ints
    at: Ints
    left: Ints
    u: Floats

    @property
    def is_key(self) -> Bools:
        """(A, K), False after an axis' last key."""
        return np.asarray(np.arange(self.at.shape[1]) < self.counts[:, None])


def find_intervals(keys: Bools, clips: StackedClips, clip_of: Ints) -> KeyIntervals:
    """Return the key intervals of axes with the `keys` (A, G), each with one or more, of the grids of their clips.

    clip_of: (A,). After a clip's own grid no time is a key.
    """
    counts = keys.sum(axis=1)
    last = counts - 1
    is_key = np.arange(int(counts.max(initial=1))) < counts[:, None]
    index = np.zeros(is_key.shape, np.int64)
    index[is_key] = np.nonzero(keys)[1]
    rows = np.arange(len(keys))[:, None]
    index = np.where(is_key, index, index[rows, last[:, None]])
    passed = np.cumsum(keys, axis=1)[rows, clips.before[clip_of]]
    left = np.clip(passed - 1, 0, np.maximum(last - 1, 0)[:, None])
    grid = clips.grid[clip_of]
    start, end = grid[rows, index[rows, left]], grid[rows, index[rows, np.minimum(left + 1, last[:, None])]]
    duration = end - start
    u = np.where(duration > 0, (clips.at[clip_of] - start) / np.where(duration > 0, duration, 1.0), 0.0)
    return KeyIntervals(counts, clips.on_grid[clip_of[:, None], index], left, np.clip(u, 0.0, 1.0, out=u))
