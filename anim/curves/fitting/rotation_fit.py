"""Approximation of an eased rotation by the fewest quaternion cubics within a tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from anim.arrays import Floats, freeze
from anim.curves.easing.function import Easing
from anim.curves.fitting.hermite_fit import FitTarget, fit_end_slopes, fit_errors
from anim.curves.fitting.subdivision import MIN_TOLERANCE, subdivide

MAX_ANGLE_RAD = np.radians(120)  # of one segment; above, the chord of unit quaternions gets short
ANGLE_STEP_RAD = np.pi / 32  # fits are shared by angles up to the next multiple
SHARING_ANGLES_RAD = ANGLE_STEP_RAD * np.arange(9) / 8  # below the multiple, for errors between: they change smoothly
MAX_FITS = 4  # attempts with smaller tolerances


@dataclass(frozen=True, slots=True)
class RotationFit:
    """Cubics for rotations of up to one angle: key u (P + 1,), rates e′ (P,) at segment ends, and error.

    Tangents per u are ½ q ⊗ (rate · rotation vector). error: greatest angle in radians from the eased rotation, for
    any rotation angle that shares the fit.
    """

    u: Floats
    leaving: Floats
    arriving: Floats
    error: float


def fit_rotation(easing: Easing, angle: float, tolerance: float) -> RotationFit:
    """Return the fewest cubics for a rotation by `angle` radians, rounded up to a multiple of π/32.

    tolerance: the greatest angle from the eased slerp, radians, 1e-7 or more. No segment rotates by more than 120°.
    90° with smoothstep at 0.1° → 4 keys
    """
    return _fit(easing, float(np.ceil(angle / ANGLE_STEP_RAD)) * ANGLE_STEP_RAD, tolerance)


@lru_cache(maxsize=1024)
def _fit(easing: Easing, angle: float, tolerance: float) -> RotationFit:
    if angle == 0:
        none = np.zeros(len(easing.breakpoints) + 1)
        return RotationFit(freeze(np.array((0.0, *easing.breakpoints, 1.0))), none, none, 0.0)
    goal = tolerance
    for _ in range(MAX_FITS):
        found, error = _subdivide_at(easing, angle, goal)
        if error > goal or found.error <= tolerance:  # next to a vertical slope no goal is reached
            break
        goal = max(goal * tolerance / found.error * 0.95, MIN_TOLERANCE)  # smaller angles have larger errors
    return found


def _subdivide_at(easing: Easing, angle: float, tolerance: float) -> tuple[RotationFit, float]:
    """Return the fewest cubics within the tolerance at one angle, and their error at this angle."""
    path = _circle(easing, angle)

    def turn_errors(a: Floats, b: Floats) -> Floats:
        wide = np.abs(easing.value(b) - easing.value(a)) * angle > MAX_ANGLE_RAD + 1e-9
        return np.where(wide, np.inf, fit_errors(path, a, b))

    ends = freeze(np.array(subdivide(turn_errors, (0.0, *easing.breakpoints, 1.0), tolerance)))
    rates = fit_end_slopes(path, ends[:-1], ends[1:])
    paths = (_circle(easing, each) for each in np.maximum(angle - SHARING_ANGLES_RAD, 0.0))
    errors = [float(fit_errors(each, ends[:-1], ends[1:], rates).max()) for each in paths]
    return RotationFit(ends, *rates, max(errors)), errors[0]


def _circle(easing: Easing, angle: float) -> FitTarget:
    """Return the rotation's path in the plane of its two quaternions: a circular arc of half the angle."""

    def point(u: Floats) -> Floats:
        half = easing.value(u) * angle / 2
        return np.stack((np.cos(half), np.sin(half)), axis=-1)

    def direction(at: Floats) -> Floats:
        return np.stack((-at[..., 1], at[..., 0]), axis=-1) * (angle / 2)

    return FitTarget(point, direction, easing.derivative, _angle, easing.breakpoints)


def _angle(fitted: Floats, true: Floats) -> Floats:
    """Return the rotation angle (...) between points (..., 2) of the plane, of any length."""
    across = fitted[..., 0] * true[..., 1] - fitted[..., 1] * true[..., 0]
    return np.asarray(2 * np.abs(np.arctan2(across, (fitted * true).sum(axis=-1))))
