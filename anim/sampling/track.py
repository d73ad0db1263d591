"""Sampling of tracks by the glTF 2.0 specification, appendix C."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from anim import arrays
from anim.arrays import Floats, Ints
from anim.maths import hermite, quaternion
from anim.model import Interpolation, ValueKind

MIN_QUATERNION_COMPONENT = 1e-9  # a quaternion whose largest component is below this has no direction
MAX_MIXED_VALUES = 1 << 18  # interpolated at a time: a dozen temporary arrays of them


class Keys(Protocol):
    """Keys of a track, or of G tracks of one kind on one time axis.

    times: (K,) s. values, tangents: (K, C), or (K, G, C).
    """

    @property
    def interpolation(self) -> Interpolation: ...
    @property
    def kind(self) -> ValueKind: ...
    @property
    def times(self) -> Floats: ...
    @property
    def values(self) -> Floats: ...
    @property
    def in_tangents(self) -> Floats | None: ...
    @property
    def out_tangents(self) -> Floats | None: ...


class KeyInterval(NamedTuple):
    """Key intervals of times, found once per time axis for all of its tracks.

    left: (F,) key at or before each time (before the first key the first). right: (F,) the next key, or the last.
    u: (F,) interpolation parameter from left to right, 0 exactly at keys and outside. duration: (F,) s from left to
    right.
    """

    left: Ints
    right: Ints
    u: Floats
    duration: Floats

    def take(self, some: slice) -> KeyInterval:
        """Return the intervals of some of the times."""
        return KeyInterval(self.left[some], self.right[some], self.u[some], self.duration[some])


def find_interval(times: Floats, at: Floats) -> KeyInterval:
    """Return the key intervals of times `at` (F,) among keys `times` (K,), clamped to the ends."""
    last = len(times) - 1
    left = np.searchsorted(times[1:], at, side="right")  # the first key before all keys
    right = np.minimum(left + 1, last)
    duration = times[right] - times[left]
    inside = (at > times[left]) & (duration > 0)
    u = np.where(inside, (at - times[left]) / np.where(duration > 0, duration, 1.0), 0.0)
    return KeyInterval(left, right, u, duration)


def sample(track: Keys, at: Floats) -> Floats:
    """Return the values (F, C) of a track, or (F, G, C) of several, at times `at` (F,) in seconds.

    At a key the key's own value; outside the keys the first or the last one; rotations are unit quaternions.
    Raises ShapeError or RangeError for invalid times.
    (0 s: 1, 2 s: 3, LINEAR) at 0.5, 9 → 1.5, 3
    """
    tangents = None
    if track.in_tangents is not None and track.out_tangents is not None:
        tangents = (track.in_tangents, track.out_tangents)
    place = find_interval(track.times, arrays.as_floats(at, "F", name="times"))
    return interpolate(place, track.values, tangents, track.interpolation, track.kind)


def interpolate(
    place: KeyInterval,
    values: Floats,
    tangents: tuple[Floats, Floats] | None,
    interpolation: Interpolation,
    kind: ValueKind,
) -> Floats:
    """Return values (..., C) in key intervals (...) of keys `values` (K, C); of G tracks (..., G, C).

    tangents: in and out, shaped as the values, per second, for CUBICSPLINE. Rotations are normalized.
    """
    is_rotation = kind is ValueKind.ROTATION
    is_early = is_rotation and interpolation is not Interpolation.CUBICSPLINE and len(values) < len(place.left)
    if is_early:  # once per key, not per time
        values = quaternion.normalize(values)
    if interpolation is Interpolation.STEP or not place.u.any():  # all at keys, whose values are exact
        start = values[place.left]
        return quaternion.normalize(start) if is_rotation and not is_early else start
    size = place.u[:1].size * math.prod(values.shape[1:])  # values of one time
    count = max(MAX_MIXED_VALUES // max(size, 1), 1)
    if len(place.u) <= count:
        return _mix(place, values, tangents, interpolation, is_rotation=is_rotation, is_unit=is_early)
    result = np.empty((*place.u.shape, *values.shape[1:]))
    for first in range(0, len(result), count):
        some = slice(first, first + count)
        mixed = _mix(place.take(some), values, tangents, interpolation, is_rotation=is_rotation, is_unit=is_early)
        result[some] = mixed
    return result


def _mix(
    place: KeyInterval,
    values: Floats,
    tangents: tuple[Floats, Floats] | None,
    interpolation: Interpolation,
    *,
    is_rotation: bool,
    is_unit: bool,
) -> Floats:
    """The values of splines and lines in key intervals. is_unit: whether rotations are normalized."""
    start = values[place.left]
    shape = place.u.shape + (1,) * (values.ndim - 1)
    u, end = place.u.reshape(shape), values[place.right]
    if interpolation is Interpolation.CUBICSPLINE and tangents is not None:
        arriving, leaving = tangents
        duration = place.duration.reshape(shape)
        result = hermite.evaluate(u, start, duration * leaving[place.left], end, duration * arriving[place.right])
        return _unit(result, start) if is_rotation else result
    if is_rotation:
        a, b = (start, end) if is_unit else (quaternion.normalize(start), quaternion.normalize(end))
        return quaternion.slerp(a, b, u[..., 0])
    return start + u * (end - start)


def _unit(rotations: Floats, instead: Floats) -> Floats:
    """The rotations at unit length; where a spline passes through zero, the left key's instead."""
    lost = (np.abs(rotations).max(axis=-1) < MIN_QUATERNION_COMPONENT)[..., None]
    return quaternion.normalize(np.where(lost, instead, rotations))
