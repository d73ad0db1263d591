"""Eased tracks: cubic segments if there is a closed form, otherwise functions of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.curves.easing.function import CubicSegment, Easing, evaluate
from anim.curves.easing.table import EASINGS
from anim.curves.fitting.easing_fit import fit_segments
from anim.curves.fitting.rotation_fit import ANGLE_STEP_RAD, RotationFit, fit_rotation
from anim.maths import hermite, quaternion
from anim.model import Interpolation, Track, ValueKind
from anim.operations.cubic_segments import CubicSegments, join_segments
from anim.sampling import segment
from anim.sampling.times import jump_time_before

KNOT_TOLERANCE = 1e-12  # of an easing; u this near to a knot between two cubics is at the knot
LINE = (CubicSegment(0, 1, 0, 1, 1, 1),)


def ease_segments(
    track: Track, inside: Bools, easing: Easing, tolerance: float, angle_tolerance: float
) -> CubicSegments:
    """Return the cubics of a LINEAR track with the segments `inside` (K − 1,) eased, the others unchanged.

    tolerance: fraction of a segment's range, for non-cubic easings. angle_tolerance: radians, for rotations.
    """
    parts = []
    for which, each in ((np.flatnonzero(inside), easing), (np.flatnonzero(~inside), EASINGS["linear"])):
        if not len(which):
            continue
        if track.kind is ValueKind.ROTATION:
            parts += _rotation_segments(track, which, each, angle_tolerance)
        else:
            parts.append(_vector_segments(track, which, fit_segments(each, tolerance=tolerance)))
    return _in_order(join_segments(parts))


def ease_steps(track: Track, inside: Bools, easing: Easing, *, angle_tolerance: float) -> CubicSegments:
    """Return the segments of a track with stepped easing `inside`, and unchanged elsewhere.

    If the last one is inside, an additional segment with the duration of a jump ends at the last key's value.
    """
    assert easing.exact is not None
    levels = np.array([(p.start, p.end, p.value0) for p in easing.exact])
    parts = []
    for k in range(len(track.times) - 1):
        if not inside[k]:
            parts.append(_source_segment(track, k, angle_tolerance))
            continue
        at = track.times[k] + (track.times[k + 1] - track.times[k]) * levels[:, :2]
        values = segment.evaluate(track, np.full(len(levels), k), levels[:, 2])
        parts.append(_constant_segments(at[:, 0], at[:, 1], values, values))
    if inside[-1]:
        end = track.times[-1:]
        parts.append(
            _constant_segments(end if inside.all() else jump_time_before(end), end, values[-1:], track.values[-1:])
        )
        parts[-2].end[-1] = parts[-1].start[0]
    return join_segments(parts) if not inside.all() else _without_last_start(join_segments(parts))


class EasedTrack:
    """Eased track as functions of time: values and one-sided derivatives."""

    def __init__(self, track: Track, inside: Bools, cubics: Sequence[CubicSegment]) -> None:
        self._track, self._inside, self._cubics = track, inside, tuple(cubics)

    def values(self, times: Floats, before: bool) -> Floats:
        """Return the values (F, C) at times (F,)."""
        left, u = self._place(times, before=before)
        return segment.evaluate(self._track, left, np.where(self._inside[left], evaluate(self._cubics, u), u))

    def rates(self, times: Floats, before: bool) -> Floats:
        """Return the one-sided derivative per second (F, C), of rotations the angular velocity (F, 3)."""
        left, u = self._place(times, before=before)
        inside = self._inside[left]
        share = np.where(inside, evaluate(self._cubics, u), u)
        tempo = np.where(inside, slope(self._cubics, u, before=before), 1.0)
        duration = self._track.times[left + 1] - self._track.times[left]
        return segment.derivative(self._track, left, share) * (tempo / duration)[:, None]

    def _place(self, times: Floats, *, before: bool) -> tuple[Ints, Floats]:
        keys = self._track.times
        found = np.searchsorted(keys, times, side="left" if before else "right") - 1
        left = np.clip(found, 0, len(keys) - 2)
        return left, np.clip((times - keys[left]) / (keys[left + 1] - keys[left]), 0.0, 1.0)


def slope(cubics: tuple[CubicSegment, ...], u: Floats, *, before: bool) -> Floats:
    """Return the slope of an easing given as cubics, just before or just after u (F,)."""
    start, end, value0, value1, slope0, slope1 = _columns(cubics).T
    shifted = u - KNOT_TOLERANCE if before else u + KNOT_TOLERANCE
    at = np.clip(np.searchsorted(start, shifted, side="right") - 1, 0, len(cubics) - 1)
    length = (end - start)[at]
    inside = np.clip((u - start[at]) / length, 0.0, 1.0)
    rise = hermite.first_derivative(inside, value0[at], length * slope0[at], value1[at], length * slope1[at])
    return np.asarray(rise / length)


def _columns(cubics: Sequence[CubicSegment]) -> Floats:
    return np.array([(p.start, p.end, p.value0, p.value1, p.slope0, p.slope1) for p in cubics])


def _vector_segments(track: Track, left: Ints, cubics: Sequence[CubicSegment]) -> CubicSegments:
    """The segments left → left + 1 (S,) of a vector track, each composed of these cubics."""
    duration = (track.times[left + 1] - track.times[left])[:, None]
    start, way = track.values[left][:, None], (track.values[left + 1] - track.values[left])[:, None]
    rows = _columns(cubics)
    at = track.times[left][:, None, None] + duration[..., None] * rows[:, :2]
    value = start[:, None] + rows[:, 2:4].T[None, :, :, None] * way[:, None]  # (S, 2, P, C)
    slope = rows[:, 4:].T[None, :, :, None] * (way / duration[..., None])[:, None]
    value[:, 0, 0], value[:, 1, -1], at[:, -1, 1] = track.values[left], track.values[left + 1], track.times[left + 1]
    flat = (each.reshape(-1, value.shape[-1]) for each in (value[:, 0], value[:, 1], slope[:, 0], slope[:, 1]))
    return CubicSegments(at[..., 0].reshape(-1), at[..., 1].reshape(-1), *flat)


def _rotation_segments(track: Track, left: Ints, easing: Easing, tolerance: float) -> list[CubicSegments]:
    """The segments left → left + 1 (S,) of a rotation track, each eased along its arc; one fit per angle."""
    q = quaternion.normalize(track.values)
    turn = quaternion.rotation_vector(quaternion.multiply(quaternion.conjugate(q[left]), q[left + 1]))
    angle = np.sqrt((turn * turn).sum(axis=1))
    shared = np.ceil(angle / ANGLE_STEP_RAD)
    parts = []
    for group in (np.flatnonzero(shared == each) for each in sorted(set(shared.tolist()))):
        fitted = fit_rotation(easing, float(angle[group].max()), tolerance)
        parts.append(_ease_rotations(track, q, left[group], turn[group], easing.value(fitted.u), fitted))
    return parts


def _ease_rotations(
    track: Track, q: Floats, left: Ints, turn: Floats, shares: Floats, fitted: RotationFit
) -> CubicSegments:
    duration = (track.times[left + 1] - track.times[left])[:, None]
    at = track.times[left][:, None] + duration * fitted.u
    at[:, -1] = track.times[left + 1]
    r = quaternion.multiply(q[left][:, None], quaternion.from_rotation_vector(shares[:, None] * turn[:, None]))
    speed = (turn / duration)[:, None]
    leaving = quaternion.derivative(r[:, :-1], fitted.leaving[:, None] * speed)
    arriving = quaternion.derivative(r[:, 1:], fitted.arriving[:, None] * speed)
    values = (each.reshape(-1, 4) for each in (r[:, :-1], r[:, 1:], leaving, arriving))
    return CubicSegments(at[:, :-1].reshape(-1), at[:, 1:].reshape(-1), *values)


def _in_order(pieces: CubicSegments) -> CubicSegments:
    order = np.argsort(pieces.start, kind="stable")
    return CubicSegments(*(getattr(pieces, each.name)[order] for each in fields(CubicSegments)))


def _source_segment(track: Track, k: int, angle_tolerance: float) -> CubicSegments:
    if track.interpolation is Interpolation.LINEAR:
        here = np.array([k])
        if track.kind is ValueKind.ROTATION:
            return _rotation_segments(track, here, EASINGS["linear"], angle_tolerance)[0]
        return _vector_segments(track, here, LINE)
    assert track.in_tangents is not None
    assert track.out_tangents is not None
    a, b = slice(k, k + 1), slice(k + 1, k + 2)
    ends = (track.times[a], track.times[b], track.values[a], track.values[b])
    return CubicSegments(*ends, track.out_tangents[a], track.in_tangents[b])


def _constant_segments(start: Floats, end: Floats, value0: Floats, value1: Floats) -> CubicSegments:
    none = np.zeros_like(value0)
    return CubicSegments(start.copy(), end.copy(), value0, value1, none, none)


def _without_last_start(pieces: CubicSegments) -> CubicSegments:
    """Segments for STEP: the last one, which only contains the last key's value, gets no key at its start."""
    ended = np.concatenate((pieces.value1[:-2], pieces.value1[-1:]))
    parts = (pieces.start[:-1], pieces.end[:-1], pieces.value0[:-1], ended, pieces.slope0[:-1], pieces.slope1[:-1])
    return CubicSegments(*parts)
