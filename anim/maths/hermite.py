"""Cubic Hermite segments between two values with given slopes, and their derivatives.

u runs from 0 to 1 over the segment. Slopes m0 and m1 are per u: a slope per second times the segment's duration h. The
arguments broadcast against each other, so for values (..., C) give u as (..., 1).
"""

from __future__ import annotations

from anim.arrays import Floats


def evaluate(u: Floats, p0: Floats, m0: Floats, p1: Floats, m1: Floats) -> Floats:
    """Return the value at u of the cubic from p0 (slope m0) to p1 (slope m1); exact at u = 0 and 1.

    evaluate(0.5, 0, 0, 1, 0) → 0.5
    Source: glTF 2.0 specification, appendix C.5.
    """
    v = 1 - u
    return (1 + 2 * u) * v * v * p0 + u * v * v * m0 + (3 - 2 * u) * u * u * p1 - u * u * v * m1


def first_derivative(u: Floats, p0: Floats, m0: Floats, p1: Floats, m1: Floats) -> Floats:
    """Return the slope per u of the same cubic; m0 and m1 exactly at 0 and 1. Divide by h for per second.

    first_derivative(0.5, 0, 0, 1, 0) → 1.5
    """
    v = 1 - u
    return 6 * u * v * (p1 - p0) + (1 - 3 * u) * v * m0 - (2 - 3 * u) * u * m1


def second_derivative(u: Floats, p0: Floats, m0: Floats, p1: Floats, m1: Floats) -> Floats:
    """Return the second derivative per u² at u of the same cubic. Divide by h² for per second squared.

    second_derivative(0, 0, 0, 1, 0) → 6
    """
    return 6 * (1 - 2 * u) * (p1 - p0) + (6 * u - 4) * m0 + (6 * u - 2) * m1
