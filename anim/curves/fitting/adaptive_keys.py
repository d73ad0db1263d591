"""Adaptive keys of a motion given by functions: segments are halved until their error is within the tolerance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats
from anim.maths import hermite, quaternion
from anim.model import Interpolation, Track
from anim.sampling.times import distinct_float32

SAMPLES = np.array(
    [0.03, 0.11, 0.21, 0.32, 0.43, 0.5, 0.57, 0.68, 0.79, 0.89, 0.97]
)  # of a segment; errors can vanish at ½ alone
MAX_ANGLE_RAD = np.radians(120)  # of one segment; above, slerp and quaternion splines are inaccurate
MIN_SEGMENT_S = 1e-5  # s; float32 times below a minute have a finer resolution
MAX_HALVINGS = 24  # greatest number of halvings of a segment


@dataclass(frozen=True, slots=True)
class TrackFunction:
    """Motion as functions of time.

    values: times (F,) s → values (F, C), unit quaternions if `rotation`.
    rates: times (F,), before → change per second just before or just after: (F, C), angular velocity (F, 3) in rad/s
    along the body's own axes for rotations.
    """

    values: Callable[[Floats], Floats]
    rates: Callable[[Floats, bool], Floats]
    rotation: bool


@dataclass(frozen=True, slots=True)
class KeySet:
    """Keys: times (K,) s, values (K, C), tangents (K, C) per second."""

    times: Floats
    values: Floats
    in_tangents: Floats
    out_tangents: Floats


def float32_tolerance(track: Track, tolerance: float) -> float:
    """Return the tolerance for vector values, at least four float32 steps of the track's largest value."""
    return max(tolerance, 4 * float(np.spacing(np.float32(np.abs(track.values).max(initial=0.0)))))


def to_cubicspline(track: Track, keys: KeySet) -> Track:
    """Return `track` with these keys as CUBICSPLINE."""
    return replace(
        track,
        interpolation=Interpolation.CUBICSPLINE,
        times=keys.times,
        values=keys.values,
        in_tangents=keys.in_tangents,
        out_tangents=keys.out_tangents,
    )


def cubic_keys(motion: TrackFunction, corners: Floats, *, tolerance: float) -> KeySet:
    """Return CUBICSPLINE keys that approximate `motion` within `tolerance`: value units, or radians for rotations.

    corners: (K,) s, increasing: required key times, including both ends; the motion must be smooth between two.
    """
    times = _bisect(motion, corners, tolerance, _cubic_segment)
    values = _values(motion, times)
    before, after = motion.rates(times, True), motion.rates(times, False)
    if motion.rotation:
        before, after = quaternion.derivative(values, before), quaternion.derivative(values, after)
    before[0], after[-1] = 0.0, 0.0
    return KeySet(times, values, before, after)


def linear_keys(motion: TrackFunction, corners: Floats, *, tolerance: float) -> KeySet:
    """Return LINEAR keys that approximate `motion` within `tolerance`; tangents are 0 and unused."""
    times = _bisect(motion, corners, tolerance, _linear_segment)
    values = _values(motion, times)
    return KeySet(times, values, np.zeros_like(values), np.zeros_like(values))


Between = Callable[[TrackFunction, Floats, Floats], Floats]  # starts, ends (P,) → values (P, S, C) at SAMPLES


def _bisect(motion: TrackFunction, corners: Floats, tolerance: float, between: Between) -> Floats:
    done = [corners]
    start, end = corners[:-1], corners[1:]
    for _ in range(MAX_HALVINGS):
        wide = end - start > MIN_SEGMENT_S
        start, end = start[wide], end[wide]
        if not len(start):
            break
        bad = _deviation(motion, start, end, between) > tolerance
        middle = (start[bad] + end[bad]) / 2
        done.append(middle)
        start, end = np.concatenate((start[bad], middle)), np.concatenate((middle, end[bad]))
    times = np.sort(np.concatenate(done))
    return times[distinct_float32(times)]


def _deviation(motion: TrackFunction, start: Floats, end: Floats, between: Between) -> Floats:
    """Greatest error of each segment (P,); infinite if its angle is too large."""
    at = start[:, None] + (end - start)[:, None] * SAMPLES
    true = motion.values(at.reshape(-1)).reshape(*at.shape, -1)
    given = between(motion, start, end)
    if not motion.rotation:
        return np.asarray(np.abs(given - true).max(axis=(1, 2), initial=0.0))
    off = quaternion.angle_between(given, true).max(axis=1)
    turned = quaternion.angle_between(true[:, 1:], true[:, :-1]).sum(axis=1)
    return np.where(turned > MAX_ANGLE_RAD, np.inf, off)


def _cubic_segment(motion: TrackFunction, start: Floats, end: Floats) -> Floats:
    a, b = motion.values(start), motion.values(end)
    leaving, arriving = motion.rates(start, False), motion.rates(end, True)
    if motion.rotation:
        b = b * np.where(quaternion.dot(a, b) < 0, -1.0, 1.0)[:, None]
        leaving, arriving = quaternion.derivative(a, leaving), quaternion.derivative(b, arriving)
    duration = (end - start)[:, None]
    piece = (each[:, None] for each in (a, duration * leaving, b, duration * arriving))
    result = hermite.evaluate(SAMPLES[None, :, None], *piece)
    return quaternion.normalize(result) if motion.rotation else result


def _linear_segment(motion: TrackFunction, start: Floats, end: Floats) -> Floats:
    a, b = motion.values(start)[:, None], motion.values(end)[:, None]
    if motion.rotation:
        return quaternion.slerp(a, b, np.broadcast_to(SAMPLES, (len(start), len(SAMPLES))))
    return np.asarray(a + SAMPLES[None, :, None] * (b - a))


def _values(motion: TrackFunction, times: Floats) -> Floats:
    values = motion.values(times)
    return quaternion.align_signs(values) if motion.rotation else values
