"""Which keys are needed: the longest straight segments that stay within one unit of the values, track by track."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats, Ints

UNBOUNDED = 1 << 30


def greedy_keys(values: Floats, times: Floats) -> Bools:
    """Return which of K values each of G tracks must keep (G, K) so that lines between them miss none by over 1.

    values: (G, K, C), scaled so that 1 is what may be missed. times: (K,). The first and the last key always stay.
    From each key the farthest reachable one is searched by doubling and then halving the step, all tracks at once;
    greedy choices of the longest segment give few keys, though not always the fewest.
    """
    tracks, count, _ = values.shape
    keep = np.zeros((tracks, count), np.bool_)
    keep[:, 0] = keep[:, -1] = True
    last = count - 1
    if count <= 2 or not tracks:
        return keep
    track = np.arange(tracks)
    start = np.zeros(tracks, np.int64)
    good, step, bad = start + 1, np.full(tracks, 2), np.full(tracks, UNBOUNDED)
    while len(track):
        doubling = bad == UNBOUNDED
        end = np.where(doubling, np.minimum(good + step, last), (good + bad) // 2)
        tested = end > good
        fits = np.zeros(len(track), np.bool_)
        if tested.any():
            fits[tested] = _straight(values, times, track[tested], start[tested], end[tested])
        good = np.where(fits, end, good)
        step = np.where(fits & doubling, step * 2, step)
        bad = np.where(tested & ~fits, end, bad)
        done = (good >= last) | (bad - good <= 1)
        if not done.any():
            continue
        keep[track[done], good[done]] = True
        length = good - start
        start = np.where(done, good, start)
        good = np.where(done, np.minimum(start + 1, last), good)
        step = np.where(done, np.maximum(1, length - 1), step)
        bad = np.where(done, UNBOUNDED, bad)
        open_ = start < last
        track, start, good, step, bad = track[open_], start[open_], good[open_], step[open_], bad[open_]
    return keep


def joint_greedy_keys(values: Floats, times: Floats) -> Bools:
    """Return which keys (K,) all tracks together must keep on one axis; as `needed`, but for the worst track."""
    count = values.shape[1]
    keep = np.zeros(count, np.bool_)
    keep[0] = keep[-1] = True
    every = np.arange(len(values))
    start = 0
    while start < count - 1:
        good, bad, step = start + 1, count, 2
        while bad - good > 1:
            end = min(good + step, count - 1) if bad == count else (good + bad) // 2
            if end <= good:
                break
            here = np.full(len(values), start), np.full(len(values), end)
            if _straight(values, times, every, *here).all():
                good, step = end, step * 2
            else:
                bad = end
        keep[good] = True
        start = good
    return keep


def _straight(values: Floats, times: Floats, track: Ints, start: Ints, end: Ints) -> Bools:
    """Whether the line of each track from key `start` to key `end` misses nothing between by over 1."""
    inner = end - start - 1
    first = np.concatenate(([0], np.cumsum(inner)[:-1]))
    own = np.repeat(np.arange(len(track)), inner)
    frame = np.arange(inner.sum()) - first[own] + start[own] + 1
    share = ((times[frame] - times[start[own]]) / (times[end] - times[start])[own])[:, None]
    a, b = values[track, start][own], values[track, end][own]
    off = a + share * (b - a) - values[track[own], frame]
    return np.asarray(np.maximum.reduceat((off * off).sum(axis=1), first) <= 1)
