"""Rates of change of tracks, by analysis, just before and just after a time."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import hermite, quaternion
from anim.model import Interpolation, Kind, Track


def tangents(track: Track, times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return in and out tangents (F, C) per second for keys at `times` (F,) with these values (F, C) of the track.

    values: as sampled; rotations with any signs, which their tangents follow.
    """
    before, after = rates(track, times, before=True), rates(track, times, before=False)
    if track.kind is Kind.ROTATION:
        return quaternion.derivative(values, before), quaternion.derivative(values, after)
    return before, after


def rates(track: Track, times: Floats, *, before: bool) -> Floats:
    """Return the rate of change just before, or just after, each time: (F, C) per second.

    Of rotations the angular velocity (F, 3) in rad/s along the turning node's own axes. STEP has rate 0, and outside
    its keys every track stands still.
    """
    rotation = track.kind is Kind.ROTATION
    result = np.zeros((len(times), 3 if rotation else track.values.shape[1]))
    if track.interpolation is Interpolation.STEP or len(track.times) == 1:
        return result
    keys = track.times
    segment = np.searchsorted(keys, times, side="left" if before else "right") - 1
    inside = (segment >= 0) & (segment < len(keys) - 1)
    left = segment[inside]
    duration = (keys[left + 1] - keys[left])[:, None]
    if track.interpolation is Interpolation.CUBICSPLINE:
        u = (times[inside] - keys[left])[:, None] / duration
        result[inside] = _of_cubic(track, left, u, duration)
    elif rotation:
        turn = quaternion.multiply(quaternion.conjugate(track.values[left]), track.values[left + 1])
        result[inside] = quaternion.rotation_vector(turn) / duration
    else:
        result[inside] = (track.values[left + 1] - track.values[left]) / duration
    return result


def _of_cubic(track: Track, left: Ints, u: Floats, duration: Floats) -> Floats:
    assert track.in_tangents is not None
    assert track.out_tangents is not None
    start, leaving = track.values[left], duration * track.out_tangents[left]
    end, arriving = track.values[left + 1], duration * track.in_tangents[left + 1]
    slope: Floats = hermite.first_derivative(u, start, leaving, end, arriving) / duration
    if track.kind is not Kind.ROTATION:
        return slope
    raw = hermite.evaluate(u, start, leaving, end, arriving)
    squared = quaternion.dot(raw, raw)[:, None]
    # q̂ = q / |q| turns with ω = 2 vec(q* q′) / |q|²: the part of q′ along q only changes the length
    return np.asarray(2 * quaternion.multiply(quaternion.conjugate(raw), slope)[:, :3] / squared)
