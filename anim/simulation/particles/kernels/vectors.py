"""Vectors of three numbers as tuples, for kernels."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from anim.skinning.kernels.jit import callee

Vector: TypeAlias = tuple[float, float, float]
Rotation: TypeAlias = tuple[float, float, float, float]  # a unit quaternion, x, y, z, w


@callee
def add(a: Vector, scale: float, b: Vector) -> Vector:
    """Return a + scale · b."""
    return (a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2])


@callee
def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@callee
def length(a: Vector) -> float:
    """Return the length."""
    return float(np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]))


@callee
def rotate(q: Rotation, a: Vector) -> Vector:
    """Return a rotated by the unit quaternion q."""
    x, y, z, w = q
    tx, ty, tz = 2 * (y * a[2] - z * a[1]), 2 * (z * a[0] - x * a[2]), 2 * (x * a[1] - y * a[0])
    return (
        a[0] + w * tx + y * tz - z * ty,
        a[1] + w * ty + z * tx - x * tz,
        a[2] + w * tz + x * ty - y * tx,
    )


@callee
def hermite(u: float, h: float, x0: Vector, v0: Vector, x1: Vector, v1: Vector) -> Vector:
    """Return the position at the fraction u of h on the cubic with these ends: of a parabola the parabola itself."""
    w = 1 - u
    a, b, c, d = (1 + 2 * u) * w * w, h * u * w * w, (3 - 2 * u) * u * u, -h * u * u * w
    return (
        a * x0[0] + b * v0[0] + c * x1[0] + d * v1[0],
        a * x0[1] + b * v0[1] + c * x1[1] + d * v1[1],
        a * x0[2] + b * v0[2] + c * x1[2] + d * v1[2],
    )


@callee
def hermite_velocity(u: float, h: float, x0: Vector, v0: Vector, x1: Vector, v1: Vector) -> Vector:
    """Return the velocity at the fraction u of h > 0 on the same cubic."""
    w = 1 - u
    a, b, c = 6 * u * w / h, (1 - 3 * u) * w, -(2 - 3 * u) * u
    return (
        a * (x1[0] - x0[0]) + b * v0[0] + c * v1[0],
        a * (x1[1] - x0[1]) + b * v0[1] + c * v1[1],
        a * (x1[2] - x0[2]) + b * v0[2] + c * v1[2],
    )
