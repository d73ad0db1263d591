"""Curves of rotations: degrees from the rest pose, Euler angles, or quaternion components."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats
from anim.maths import euler, quaternion
from anim.model import Interpolation, Track
from anim.sampling.track import sample
from anim.show.plots import polylines
from anim.show.plots.polylines import Polyline

FROM_REST, COMPONENTS = "from rest", "components"  # views; the others are the twelve orders of Euler angles
FLOAT32_GIMBAL_TOLERANCE_RAD = 1e-6  # rad from lock, below which float32 rotations can't separate first and third angle
NEAR_LOCK_DEG = 5.0  # rates of angles are amplified 23 times there
REVOLUTION_DEG = 360.0
MAX_LINE_STEP_DEG = 3.0  # between points of a line; Euler angles race near lock, where the rotation itself does not
MIN_BLOCK, MAX_BLOCK = 64, 65_536  # vectors that are compared at once
MAX_REFINEMENTS = 6  # halvings of the time between two points


@dataclass(frozen=True, slots=True)
class RotationCurve:
    """Drawn curve of a track. line: values over time. keys: (K, C). risers: jumps of STEP, or None."""

    line: Polyline
    keys: Floats
    risers: Polyline | None


def rotation_curve(track: Track, *, view: str, rest: Floats) -> RotationCurve:
    """Return a rotation track in degrees (…, 3): about the joint's own axes from rest, or as Euler angles.

    view: FROM_REST, or an order such as "ZXY", intrinsic. rest: (4,). Values are continuous, without jumps of 360°.
    """
    if track.interpolation is Interpolation.STEP or len(track.times) == 1:
        keys = degrees(track.values, view=view, rest=rest)
        held = replace(track, path="translation", values=keys, interpolation=Interpolation.STEP)
        return RotationCurve(polylines.value_line(held), keys, polylines.step_edges(held))
    times = polylines.value_line(track).times
    values = degrees(sample(track, times), view=view, rest=rest)
    for _ in range(0 if polylines.is_dense(track) else MAX_REFINEMENTS):
        coarse = np.flatnonzero(np.abs(np.diff(values, axis=0)).max(axis=1) > MAX_LINE_STEP_DEG)
        if not len(coarse):
            break
        times = np.insert(times, coarse + 1, (times[coarse] + times[coarse + 1]) / 2)
        values = degrees(sample(track, times), view=view, rest=rest)
    at = np.searchsorted(times, track.times).clip(max=len(values) - 1)
    return RotationCurve(Polyline(times, values), values[at], None)


def degrees(q: Floats, *, view: str, rest: Floats) -> Floats:
    """Return rotations (P, 4) in order of time as degrees (P, 3)."""
    unit = quaternion.normalize(q)
    if view == FROM_REST:
        return _continuous(quaternion.multiply(quaternion.conjugate(rest), unit))
    return np.degrees(euler.unwrap(unit, order=view, lock=FLOAT32_GIMBAL_TOLERANCE_RAD))


def gimbal_distance_line(track: Track, *, order: str) -> Polyline:
    """Return the distance (P, 1) in rad, 0 … π/2, of a rotation from the gimbal lock of an order."""
    keys = track.times
    times = polylines.value_line(track).times if len(keys) > 1 else keys
    if track.interpolation is Interpolation.STEP:
        line = polylines.value_line(track)
        held = np.isnan(line.values[:, 0])
        q = quaternion.normalize(np.where(held[:, None], track.values[:1], line.values))
        return Polyline(line.times, np.where(held, np.nan, euler.gimbal_distance(q, order=order))[:, None])
    q = quaternion.normalize(sample(track, times))
    return Polyline(times, euler.gimbal_distance(q, order=order)[:, None])


def _continuous(q: Floats) -> Floats:
    """Rotation vectors (P, 3) in degrees of unit quaternions (P, 4), continuous beyond 180°."""
    vectors = np.degrees(quaternion.rotation_vector(quaternion.align_signs(q)))
    lengths = np.sqrt(_dots(vectors, vectors))
    axes = vectors / np.where(lengths > 0, lengths, 1.0)[:, None]
    turned = np.zeros(len(vectors))  # degrees to add along each axis
    at, size = 1, MIN_BLOCK
    while at < len(vectors):
        block = slice(at, at + size)
        before = slice(at - 1, at - 1 + len(vectors[block]))
        given = turned[at - 1]  # as long as it stays, all following vectors are compared at once
        found = np.rint((_dots(vectors[before] + given * axes[before], axes[block]) - lengths[block]) / REVOLUTION_DEG)
        found *= REVOLUTION_DEG
        changed = np.flatnonzero(found != given)
        used = int(changed[0]) + 1 if len(changed) else len(found)
        turned[at : at + used] = found[:used]
        at, size = at + used, min(2 * size, MAX_BLOCK) if used == len(found) else MIN_BLOCK
    return np.asarray(vectors + turned[:, None] * axes)


def _dots(a: Floats, b: Floats) -> Floats:
    """Products (P,) of vectors (P, 3), each rounded as by `@` of two vectors."""
    return np.asarray((a[:, None] @ b[:, :, None])[:, 0, 0])
