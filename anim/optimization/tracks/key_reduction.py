"""Key reduction of linear tracks within a tolerance, one by one or jointly, and of pointer tracks."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.curves.fitting.key_reduction import greedy_segments
from anim.model import Interpolation, Track, ValueKind
from anim.optimization.tracks.lossless import reduce_lossless
from anim.sampling.track import sample

POINTER_BOUND_FRACTION = 0.9  # of the bound; the rest covers rounding to float32


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
        same = np.zeros_like(every)
        return np.array([_is_straight(values, times, every, same + start, same + end).all()])

    return np.asarray(greedy_segments(1, values.shape[1], fits)[0])


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
