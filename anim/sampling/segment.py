"""Segments of a track, from key k to key k + 1, extrapolated beyond both ends."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import hermite, quaternion
from anim.model import Interpolation, Track, ValueKind
from anim.sampling.track import Keys

SAMPLES_PER_SEGMENT = 64  # and on each side where it is extrapolated; a rotation has peaks where its spline is near 0
BLOCK_SAMPLES = 1 << 17  # taken at a time, in about 50 MB


def evaluate(track: Track, left: Ints, share: Floats) -> Floats:
    """Return the values (F, C) at fractions `share` (F,) of the segments `left` (F,); rotations are unit.

    Below 0 and above 1 the segment's own line, arc or cubic is extrapolated, not clamped.
    """
    start, end = track.values[left], track.values[left + 1]
    if track.interpolation is Interpolation.STEP:
        result = np.where(share[:, None] < 1, start, end)
    elif track.interpolation is Interpolation.CUBICSPLINE:
        result = hermite.evaluate(share[:, None], *_cubic(track, left))
    elif track.kind is ValueKind.ROTATION:
        return quaternion.slerp(quaternion.normalize(start), quaternion.normalize(end), share)
    else:
        return np.asarray(start + share[:, None] * (end - start))
    return quaternion.normalize(result) if track.kind is ValueKind.ROTATION else result


def derivative(track: Keys, left: Ints, share: Floats) -> Floats:
    """Return the derivative per u (F, C), of several tracks (F, G, C).

    Of rotations the angular velocity (F, 3), (F, G, 3) in rad about own axes.
    """
    rotation = track.kind is ValueKind.ROTATION
    if track.interpolation is Interpolation.STEP:
        return np.zeros((len(left), *track.values.shape[1:-1], 3 if rotation else track.values.shape[-1]))
    if track.interpolation is Interpolation.CUBICSPLINE:
        u = column(share, track)
        slope = hermite.first_derivative(u, *_cubic(track, left))
        if not rotation:
            return slope
        raw = hermite.evaluate(u, *_cubic(track, left))
        # q / |q| rotates with ω = 2 vec(q* q′) / |q|²: the component of q′ along q only changes the length
        turned = quaternion.multiply(quaternion.conjugate(raw), slope)[..., :3]
        return np.asarray(2 * turned / quaternion.dot(raw, raw)[..., None])
    start, end = track.values[left], track.values[left + 1]
    if rotation:
        return quaternion.rotation_vector(quaternion.multiply(quaternion.conjugate(start), end))
    return np.asarray(end - start)


def column(numbers: Floats, track: Keys) -> Floats:
    """Return numbers (F,), one per time, as (F, 1) or (F, 1, 1), to multiply values of a track or of several."""
    return numbers.reshape(-1, *[1] * (track.values.ndim - 1))


def max_rate(track: Track, pieces: Ints, *, extent: tuple[float, float] = (0.0, 1.0)) -> float:
    """Return the greatest derivative per u in the segments `pieces`: length, or angular speed in rad.

    extent: least and greatest u, beyond 0 … 1 where the segments are extrapolated.
    """
    return _max_rate(track, pieces, extent, np.ones(len(track.times) - 1))


def max_rate_per_second(track: Track) -> float:
    """Return the greatest derivative of the track per second: vector length, or angular speed in rad/s."""
    return _max_rate(track, np.arange(len(track.times) - 1), (0.0, 1.0), np.diff(track.times))


def _max_rate(track: Track, pieces: Ints, extent: tuple[float, float], durations: Floats) -> float:
    """The greatest derivative per u in `pieces`, divided by the durations (K - 1,)."""
    low, high = extent
    parts = pairwise(sorted({low, 0.0, 1.0, high}))
    fractions = np.concatenate([np.linspace(*part, SAMPLES_PER_SEGMENT + 1) for part in parts])
    if track.interpolation is Interpolation.LINEAR:
        fractions = fractions[:1]
    greatest, step = 0.0, BLOCK_SAMPLES // len(fractions)
    for first in range(0, len(pieces), step):
        some = pieces[first : first + step]
        left = np.repeat(some, len(fractions))
        found = derivative(track, left, np.tile(fractions, len(some)))
        rates = np.sqrt((found * found).sum(axis=1)) / durations[left]
        greatest = float(np.maximum(greatest, rates.max()))  # NaN stays
    return greatest


def _cubic(track: Keys, left: Ints) -> tuple[Floats, Floats, Floats, Floats]:
    assert track.in_tangents is not None
    assert track.out_tangents is not None
    duration = column(track.times[left + 1] - track.times[left], track)
    return (
        track.values[left],
        duration * track.out_tangents[left],
        track.values[left + 1],
        duration * track.in_tangents[left + 1],
    )
