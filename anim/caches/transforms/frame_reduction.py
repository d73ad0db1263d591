"""Reduce frames under a bound on the error of linear interpolation."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray, Floats, Ints

BATCH = 1 << 22  # values compared at a time


def reduce_frames(positions: AnyArray, times: Floats, limit: float) -> Ints:
    """Return the indices of frames to keep: linear interpolation reproduces the others within `limit` m.

    positions (F, V, 3). The first and the last frame are kept. Greedy: each interval is extended as far as possible, by
    doubling and bisection, so the result is near the minimum but not always equal to it.
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
