"""Analytic one-sided derivatives of tracks."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Interpolation, Track, ValueKind
from anim.sampling import segment
from anim.sampling.track import Keys


def tangents(track: Track, times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return in and out tangents (F, C) per second for keys at `times` (F,) with sampled values (F, C).

    values: rotations can have any signs; their tangents get the same.
    """
    before, after = rates(track, times, before=True), rates(track, times, before=False)
    if track.kind is ValueKind.ROTATION:
        return quaternion.derivative(values, before), quaternion.derivative(values, after)
    return before, after


def rates(track: Keys, times: Floats, *, before: bool) -> Floats:
    """Return the derivative just before, or just after, each time: (F, C) per second, of several tracks (F, G, C).

    Of rotations the angular velocity (F, 3) in rad/s about the node's own axes. STEP has rate 0, and so has every track
    outside its keys.
    """
    *tracks, width = track.values.shape[1:]
    result = np.zeros((len(times), *tracks, 3 if track.kind is ValueKind.ROTATION else width))
    if track.interpolation is Interpolation.STEP or len(track.times) == 1:
        return result
    keys = track.times
    index = np.searchsorted(keys, times, side="left" if before else "right") - 1
    inside = (index >= 0) & (index < len(keys) - 1)
    left = index[inside]
    duration = keys[left + 1] - keys[left]
    u = (times[inside] - keys[left]) / duration
    result[inside] = segment.derivative(track, left, u) / segment.column(duration, track)
    return result
