"""Polynomial easings: linear, smoothstep, smootherstep, and the cubic with given end slopes."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.curves.easing.function import MAX_PARAMETER, CubicSegment, Easing, format_call
from anim.errors import RangeError
from anim.maths import hermite as cubic

ZERO, ONE = np.zeros(()), np.ones(())


def hermite(slope0: float, slope1: float, *, name: str = "") -> Easing:
    """Return the cubic easing with slopes `slope0` and `slope1` at its ends, relative to constant speed.

    Slopes of at most MAX_PARAMETER: negative ones undershoot, large ones overshoot. Raises RangeError for others.
    hermite(0, 0) → smoothstep, hermite(1, 1) → linear, hermite(0, 3) → cubic-in
    """
    if not np.abs((slope0, slope1)).max() <= MAX_PARAMETER:
        raise RangeError(f"slopes are {slope0:g} and {slope1:g} (expected -{MAX_PARAMETER} … {MAX_PARAMETER})")
    m0, m1 = np.asarray(slope0, dtype=np.float64), np.asarray(slope1, dtype=np.float64)
    return Easing(
        name or format_call("hermite", slope0, slope1),
        lambda u: cubic.evaluate(u, ZERO, m0, ONE, m1),
        lambda u: cubic.first_derivative(u, ZERO, m0, ONE, m1),
        exact=(CubicSegment(0, 1, 0, 1, float(slope0), float(slope1)),),
    )


def linear() -> Easing:
    """Return constant speed."""
    return Easing("linear", lambda u: 1.0 * u, np.ones_like, exact=(CubicSegment(0, 1, 0, 1, 1, 1),))


def smoothstep() -> Easing:
    """Return 3u² − 2u³: zero speed at both ends, the minimum of integrated squared acceleration."""

    def value(u: Floats) -> Floats:
        return u * u * (3 - 2 * u)

    return Easing("smoothstep", value, lambda u: 6 * u * (1 - u), exact=(CubicSegment(0, 1, 0, 1, 0, 0),))


def smootherstep() -> Easing:
    """Return 10u³ − 15u⁴ + 6u⁵: zero speed and acceleration at both ends, least integrated squared jerk.

    Source: Flash & Hogan 1985 (minimum jerk); Perlin 2002 (the same polynomial, for noise).
    """

    def value(u: Floats) -> Floats:
        return u * u * u * (10 + u * (6 * u - 15))

    return Easing("smootherstep", value, lambda u: 30 * u * u * (1 - u) * (1 - u))
