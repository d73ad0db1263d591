"""Key reduction: greedy longest segments within a tolerance, of any motion or of linear tracks."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np

from anim.arrays import Bools, Floats, Ints

UNBOUNDED = 1 << 30
KEYS_PER_PART = 8192  # of longer tracks; their parts are searched at once, and a key stays between two of them

SegmentTest: TypeAlias = Callable[[Ints, Ints, Ints], Bools]  # track, start, end key (B,) → True where within tolerance


def greedy_segments(tracks: int, count: int, fits: SegmentTest) -> Bools:
    """Return the keys (G, K) that remain of `count` keys of each track; the first and the last always do.

    fits: whether a segment between two keys replaces those between; asked for segments with a key between only.
    From each key the farthest reachable one is searched by doubling and then halving the step, all tracks and all
    their parts of KEYS_PER_PART keys at once; greedy choices of the longest segment give few keys, though not always
    the fewest.
    """
    keep = np.zeros((tracks, count), np.bool_)
    ends = np.append(np.arange(KEYS_PER_PART, count - 1, KEYS_PER_PART), count - 1)  # of the parts
    keep[:, 0] = True
    keep[:, ends] = True
    if count <= 2 or not tracks:
        return keep
    track, last = np.repeat(np.arange(tracks), len(ends)), np.tile(ends, tracks)
    start = np.tile(np.append(0, ends[:-1]), tracks)
    good, step, bad = np.minimum(start + 1, last), np.full(len(track), 2), np.full(len(track), UNBOUNDED)
    while len(track):
        doubling = bad == UNBOUNDED
        end = np.where(doubling, np.minimum(good + step, last), (good + bad) // 2)
        tested = end > good
        within = np.zeros(len(track), np.bool_)
        if tested.any():
            within[tested] = fits(track[tested], start[tested], end[tested])
        good = np.where(within, end, good)
        step = np.where(within & doubling, step * 2, step)
        bad = np.where(tested & ~within, end, bad)
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
        track, last, start = track[open_], last[open_], start[open_]
        good, step, bad = good[open_], step[open_], bad[open_]
    return keep


def greedy_indices(count: int, fits: Callable[[int, int], bool]) -> Ints:
    """Return the indices of the remaining keys of one track; fits: as for `greedy_segments`."""

    def each_fits(_: Ints, start: Ints, end: Ints) -> Bools:
        return np.array([fits(*pair) for pair in zip(start.tolist(), end.tolist(), strict=True)])

    return np.flatnonzero(greedy_segments(1, count, each_fits)[0])


def greedy_keys(values: Floats, times: Floats) -> Bools:
    """Return the keys (G, K) of G tracks so that linear interpolation has no error above 1.

    values: (G, K, C), scaled so that 1 is the tolerance. times: (K,). The first and the last key always stay.
    """
    tracks, count, _ = values.shape
    return greedy_segments(tracks, count, partial(_is_straight, values, times))


def joint_greedy_keys(values: Floats, times: Floats) -> Bools:
    """Return the keys (K,) of all tracks on one axis; as `greedy_keys`, with the error of the worst track."""
    every = np.arange(len(values))

    def fits(_: Ints, start: Ints, end: Ints) -> Bools:
        pairs = np.repeat(np.stack((start, end)), len(every), axis=1)
        within = _is_straight(values, times, np.tile(every, len(start)), *pairs)
        return np.asarray(within.reshape(len(start), len(every)).all(axis=1))

    return np.asarray(greedy_segments(1, values.shape[1], fits)[0])


def _is_straight(values: Floats, times: Floats, track: Ints, start: Ints, end: Ints) -> Bools:
    """Return whether the line of each track from key `start` to key `end` has errors up to 1 between."""
    inner = end - start - 1
    first = np.concatenate(([0], np.cumsum(inner)[:-1]))
    own = np.repeat(np.arange(len(track)), inner)
    frame = np.arange(inner.sum()) - first[own] + start[own] + 1
    u = ((times[frame] - times[start[own]]) / (times[end] - times[start])[own])[:, None]
    a, b = values[track, start][own], values[track, end][own]
    error = a + u * (b - a) - values[track[own], frame]
    return np.asarray(np.maximum.reduceat((error * error).sum(axis=1), first) <= 1)
