"""Approximation of an eased rotation by the fewest quaternion cubics within a tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from anim.arrays import Floats, freeze
from anim.curves.easing.function import Easing
from anim.curves.fitting.hermite_fit import FitTarget, fit_end_slopes, fit_errors
from anim.curves.fitting.subdivision import subdivide
from anim.errors import RangeError
from anim.maths import quaternion as quat

MAX_ANGLE_RAD = np.radians(120)  # of one segment; above, the chord of unit quaternions gets short
ANGLE_STEP_RAD = np.pi / 32  # fits are shared by angles up to the next multiple


@dataclass(frozen=True, slots=True)
class RotationKeys:
    """Keys of a rotation: u (K,) from 0 to 1, unit quaternions (K, 4) in one hemisphere, tangents (K, 4) per u.

    The tangents before the first and after the last key are 0. error: greatest angle in rad from the exact one.
    """

    u: Floats
    rotations: Floats
    in_tangents: Floats
    out_tangents: Floats
    error: float


def fit_rotation(q0: Floats, q1: Floats, easing: Easing, tolerance: float) -> RotationKeys:
    """Return the fewest CUBICSPLINE keys that rotate q0 to q1 (4,) along the shorter arc with an easing.

    tolerance: the greatest angle from the eased slerp, radians, 1e-7 or more; the result's `error` is the actual one.
    No segment rotates by more than 120°. The result's signs follow q0's, so its last key may be −q1. Tangents are
    ½ q ⊗ ω, ω = axis · θ · e′(u); divide them by the segment's duration.
    Raises RangeError for a tolerance out of range, or for steps, which need a STEP sampler.
    90° with smoothstep at 0.1° → 4 keys
    """
    if easing.stepped:
        raise RangeError(f"'{easing.name}' jumps (expected a continuous ease; write STEP keys)")
    turn = quat.rotation_vector(quat.multiply(quat.conjugate(q0), q1))
    angle = float(np.sqrt(turn @ turn))
    ends, rate0, rate1, error = fit_rotation_segments(
        easing, float(np.ceil(angle / ANGLE_STEP_RAD)) * ANGLE_STEP_RAD, tolerance
    )
    if angle > 0:
        error = _error(easing, angle, ends, rate0, rate1)
    if error > tolerance:
        ends, rate0, rate1, error = fit_rotation_segments(easing, angle, tolerance)
    rotations = quat.multiply(q0, quat.from_rotation_vector(easing.value(ends)[:, None] * turn))
    rotations[0], rotations[-1] = q0, q1 if quat.dot(q0, q1) >= 0 else -q1
    in_tangents = quat.derivative(rotations, np.append(0.0, rate1)[:, None] * turn)
    out_tangents = quat.derivative(rotations, np.append(rate0, 0.0)[:, None] * turn)
    return RotationKeys(ends, rotations, in_tangents, out_tangents, error)


@dataclass(frozen=True, slots=True)
class RotationFit:
    """Cubics for rotations of up to one angle: key u (P + 1,), start and end rates e′ (P,) of segments, and error.

    Tangents per u are ½ q ⊗ (rate · rotation vector). error: greatest angle in radians from the eased rotation.
    """

    u: Floats
    leaving: Floats
    arriving: Floats
    error: float


def rotation_segments_for(easing: Easing, angle: float, tolerance: float) -> RotationFit:
    """Return the fewest cubics for a rotation by `angle` radians; angles are rounded up to multiples of π/32."""
    rounded = float(np.ceil(angle / ANGLE_STEP_RAD)) * ANGLE_STEP_RAD
    return RotationFit(*fit_rotation_segments(easing, rounded, tolerance))


@lru_cache(maxsize=1024)
def fit_rotation_segments(easing: Easing, angle: float, tolerance: float) -> tuple[Floats, Floats, Floats, float]:
    """Return key u (K,), start and end rates e′ (K − 1,) of the segments, and the greatest error as an angle."""
    edges = (0.0, *easing.breakpoints, 1.0)
    if angle == 0:
        none = np.zeros(len(edges) - 1)
        return freeze(np.array(edges)), none, none, 0.0
    path = _circle(easing, angle)

    def turn_errors(a: Floats, b: Floats) -> Floats:
        wide = np.abs(easing.value(b) - easing.value(a)) * angle > MAX_ANGLE_RAD + 1e-9
        return np.where(wide, np.inf, fit_errors(path, a, b))

    ends = freeze(np.array(subdivide(turn_errors, edges, tolerance)))
    rate0, rate1 = fit_end_slopes(path, ends[:-1], ends[1:])
    return ends, rate0, rate1, _error(easing, angle, ends, rate0, rate1)


def _error(easing: Easing, angle: float, ends: Floats, rate0: Floats, rate1: Floats) -> float:
    return float(fit_errors(_circle(easing, angle), ends[:-1], ends[1:], (rate0, rate1)).max())


def _circle(easing: Easing, angle: float) -> FitTarget:
    """Return the rotation's path in the plane of its two quaternions: a circular arc of half the angle."""

    def point(u: Floats) -> Floats:
        half = easing.value(u) * angle / 2
        return np.stack((np.cos(half), np.sin(half)), axis=-1)

    def direction(u: Floats) -> Floats:
        half = easing.value(u) * angle / 2
        return np.stack((-np.sin(half), np.cos(half)), axis=-1) * (angle / 2)

    return FitTarget(point, direction, easing.derivative, _angle, easing.breakpoints)


def _angle(fitted: Floats, true: Floats) -> Floats:
    """Return the rotation angle (...) between points (..., 2) of the plane, of any length."""
    across = fitted[..., 0] * true[..., 1] - fitted[..., 1] * true[..., 0]
    return np.asarray(2 * np.abs(np.arctan2(across, (fitted * true).sum(axis=-1))))
