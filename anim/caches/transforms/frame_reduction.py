"""The fewest frames between which straight lines stay near all others."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray, Floats, Ints

BATCH = 1 << 22  # numbers compared at a time


def reduce_frames(positions: AnyArray, times: Floats, limit: float) -> Ints:
    """Return the numbers of frames to keep: every vertex of the others lies within `limit` m of the line between.

    positions (F, V, 3). The first and the last frame stay. Greedy: each step goes as far as it can, found by doubling
    and halving, so it is near the fewest but not always there.
    """
    kept, last = [0], len(positions) - 1
    while kept[-1] < last:
        start, reach = kept[-1], 1
        while start + 2 * reach <= last and _fits(positions, times, start, start + 2 * reach, limit):
            reach *= 2
        low, high = start + reach, min(start + 2 * reach, last + 1)
        if high == last + 1 and _fits(positions, times, start, last, limit):
            low = last
        while high - low > 1 and low < last:
            middle = (low + high) // 2
            if _fits(positions, times, start, middle, limit):
                low = middle
            else:
                high = middle
        kept.append(low)
    return np.array(kept, np.int64)


def _fits(positions: AnyArray, times: Floats, start: int, end: int, limit: float) -> bool:
    step = max(1, BATCH // max(positions[0].size, 1))
    delta = positions[end] - positions[start]
    for first in range(start + 1, end, step):
        rows = slice(first, min(first + step, end))
        share = ((times[rows] - times[start]) / (times[end] - times[start])).astype(np.float32)
        off = positions[rows] - (positions[start] + share[:, None, None] * delta)
        if float(np.einsum("fvi,fvi->fv", off, off).max(initial=0.0)) > limit * limit:
            return False
    return True
