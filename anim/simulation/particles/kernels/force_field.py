"""Accelerations of a particle, and one step of each time integrator, compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.simulation.particles.kernels.vectors import Vector, add, dot, length
from anim.skinning.kernels.jit import jit

METHODS = ("explicit-euler", "symplectic-euler", "velocity-verlet", "rk4", "implicit-euler")  # their codes are indices


class UniformForces(NamedTuple):
    """Forces that are the same everywhere. gravity: m/s². linear_drag: 1/s, quadratic_drag: 1/m. wind: m/s."""

    gravity: Vector
    linear_drag: float
    quadratic_drag: float
    wind: Vector


class ForceField(NamedTuple):
    """All forces of a run.

    modes: (M, 8) of the turbulence: wave vector in 1/m, amplitude in m/s, rate in 1/s, phase. attractors: (A, 2),
    strength in m/s² at the radius in m. centers: (S, A, 3) m at the ends of steps, or (1, A, 3). step: s. first: index
    of the step that begins at centers[0]. is_uniform: without turbulence and attractors.
    """

    uniform: UniformForces
    modes: Floats
    attractors: Floats
    centers: Floats
    step: float
    first: int
    is_uniform: bool


@jit
def uniform_acceleration(forces: UniformForces, t: float, x: Vector, v: Vector) -> Vector:
    """Return the acceleration in m/s² by gravity and drag."""
    relative = add(v, -1.0, forces.wind)
    factor = forces.linear_drag
    if forces.quadratic_drag > 0.0:
        factor += forces.quadratic_drag * length(relative)
    return add(forces.gravity, -factor, relative)


@jit
def acceleration(field: ForceField, t: float, x: Vector, v: Vector) -> Vector:
    """Return the acceleration in m/s² by all forces at t s."""
    a = uniform_acceleration(field.uniform, t, x, add(v, -1.0, air_motion(field, t, x)))
    for k in range(len(field.attractors)):
        towards = add(attractor_center(field, k, t), -1.0, x)
        a = add(a, pull_per_metre(field.attractors[k, 0], field.attractors[k, 1], length(towards)), towards)
    return a


@jit
def air_motion(field: ForceField, t: float, x: Vector) -> Vector:
    """Return the velocity of the air relative to the wind: random Fourier modes at right angles to their waves."""
    ux = uy = uz = 0.0
    modes = field.modes
    for m in range(len(modes)):
        wave = modes[m, 0] * x[0] + modes[m, 1] * x[1] + modes[m, 2] * x[2]
        c = np.cos(wave + modes[m, 6] * t + modes[m, 7])
        ux += c * modes[m, 3]
        uy += c * modes[m, 4]
        uz += c * modes[m, 5]
    return (ux, uy, uz)


@jit
def attractor_center(field: ForceField, k: int, t: float) -> Vector:
    """Return the center of an attractor at t s, linear between the ends of steps."""
    centers = field.centers
    last = len(centers) - 1
    at = min(max(t / field.step - field.first, 0.0), float(last))
    i = min(int(at), max(last - 1, 0))
    u, a, b = at - i, centers[i, k], centers[min(i + 1, last), k]
    return (a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1]), a[2] + u * (b[2] - a[2]))


@jit
def pull_per_metre(strength: float, radius: float, distance: float) -> float:
    """Return the acceleration towards an attractor over the distance: gravity of a ball, uniform inside."""
    return strength / radius if distance <= radius else strength * radius * radius / (distance * distance * distance)


@jit
def potential(field: ForceField, t: float, x: Vector) -> float:
    """Return the potential energy in J/kg of gravity, 0 at the origin, and of attractors, 0 far away."""
    energy = -dot(field.uniform.gravity, x)
    for k in range(len(field.attractors)):
        s, radius = field.attractors[k, 0], field.attractors[k, 1]
        d = length(add(attractor_center(field, k, t), -1.0, x))
        energy += 0.5 * s * (d * d / radius - 3 * radius) if d <= radius else -s * radius * radius / d
    return energy


@jit
def uniform_implicit_change(forces: UniformForces, t: float, x: Vector, v: Vector, h: float) -> Vector:
    """Return the change of velocity of one Newton step of implicit Euler under uniform forces."""
    a = uniform_acceleration(forces, t, x, v)
    return _solve(forces, add(v, -1.0, forces.wind), (h * a[0], h * a[1], h * a[2]), h, 0.0)


@jit
def implicit_change(field: ForceField, t: float, x: Vector, v: Vector, h: float) -> Vector:
    """Return the change of velocity of one Newton step of implicit Euler.

    It solves (I − h ∂a/∂v − h² ∂a/∂x) dv = h (a + h ∂a/∂x v), where attractors count without the part of their gradient
    that pushes outwards, and turbulence without gradient: the matrix stays positive definite.
    """
    stiffness = 0.0
    for k in range(len(field.attractors)):
        towards = add(attractor_center(field, k, t), -1.0, x)
        stiffness += max(pull_per_metre(field.attractors[k, 0], field.attractors[k, 1], length(towards)), 0.0)
    a = add(acceleration(field, t, x, v), -h * stiffness, v)
    relative = add(add(v, -1.0, field.uniform.wind), -1.0, air_motion(field, t, x))
    return _solve(field.uniform, relative, (h * a[0], h * a[1], h * a[2]), h, stiffness)


@jit
def _solve(forces: UniformForces, relative: Vector, right: Vector, h: float, stiffness: float) -> Vector:
    """Solution of (diagonal · I + b r rᵀ) dv = right, r being the velocity relative to the air."""
    speed = length(relative)
    diagonal = 1.0 + h * (forces.linear_drag + forces.quadratic_drag * speed) + h * h * stiffness
    b = h * forces.quadratic_drag / max(speed, 1e-300)
    along = dot(relative, right) * b / (diagonal + b * speed * speed)
    return add((right[0] / diagonal, right[1] / diagonal, right[2] / diagonal), -along / diagonal, relative)


def _integrator(force: Callable[..., Vector], change: Callable[..., Vector]) -> Callable[..., tuple[Vector, Vector]]:
    """Return the function of one step for forces with this acceleration, and this change by implicit Euler."""

    @jit
    def integrate(forces: Any, method: int, t: float, x: Vector, v: Vector, h: float) -> tuple[Vector, Vector]:
        """Return position and velocity at t + h by METHODS[method]."""
        if method == 0:
            return add(x, h, v), add(v, h, force(forces, t, x, v))
        if method == 1:
            v = add(v, h, force(forces, t, x, v))
            return add(x, h, v), v
        if method == 2:
            half = add(v, 0.5 * h, force(forces, t, x, v))
            x = add(x, h, half)
            return x, add(half, 0.5 * h, force(forces, t + h, x, half))
        if method == 3:
            a1 = force(forces, t, x, v)
            v2 = add(v, 0.5 * h, a1)
            a2 = force(forces, t + 0.5 * h, add(x, 0.5 * h, v), v2)
            v3 = add(v, 0.5 * h, a2)
            a3 = force(forces, t + 0.5 * h, add(x, 0.5 * h, v2), v3)
            v4 = add(v, h, a3)
            a4 = force(forces, t + h, add(x, h, v3), v4)
            dx = add(add(add(v, 2.0, v2), 2.0, v3), 1.0, v4)
            dv = add(add(add(a1, 2.0, a2), 2.0, a3), 1.0, a4)
            return add(x, h / 6, dx), add(v, h / 6, dv)
        v = add(v, 1.0, change(forces, t, x, v, h))
        return add(x, h, v), v

    return integrate


integrate = _integrator(acceleration, implicit_change)
integrate_uniform = _integrator(uniform_acceleration, uniform_implicit_change)
