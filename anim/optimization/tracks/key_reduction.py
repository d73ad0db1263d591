"""Key reduction: greedy longest linear segments within a tolerance, track by track or jointly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.model import Interpolation, Track, ValueKind
from anim.optimization.tracks.lossless import reduce_lossless
from anim.sampling.track import sample

UNBOUNDED = 1 << 30
POINTER_BOUND_FRACTION = 0.9  # of the bound; the rest covers rounding to float32


def greedy_keys(values: Floats, times: Floats) -> Bools:
    """Return the keys (G, K) of G tracks so that linear interpolation has no error above 1.

    values: (G, K, C), scaled so that 1 is the tolerance. times: (K,). The first and the last key always stay.
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
            fits[tested] = _is_straight(values, times, track[tested], start[tested], end[tested])
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
    """Return the keys (K,) of all tracks on one axis; as `greedy_keys`, with the error of the worst track."""
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
            if _is_straight(values, times, every, *here).all():
                good, step = end, step * 2
            else:
                bad = end
        keep[good] = True
        start = good
    return keep


def reduce_pointer_keys(track: Track, bound: float) -> Track:
    """Return a pointer track in fewer keys, with an error up to `bound` as a fraction of its range.

    Only LINEAR tracks are reduced; STEP and CUBICSPLINE keep every key that changes something.
    """
    extent = float(np.ptp(track.values, axis=0).max(initial=0.0))
    if bound <= 0 or extent == 0 or track.interpolation is not Interpolation.LINEAR or track.kind is ValueKind.DISCRETE:
        return reduce_lossless(track)
    if track.kind is ValueKind.ROTATION:
        extent = 1.0
    scaled = sample(track, track.times) / (POINTER_BOUND_FRACTION * bound * extent)
    keep = greedy_keys(scaled[None], track.times)[0]
    return reduce_lossless(replace(track, times=track.times[keep], values=track.values[keep]))


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
