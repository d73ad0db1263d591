"""Accelerations of a particle, and one step of each time integrator, compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from anim.arrays import Floats
from anim.simulation.particles.kernels.turbulence import turbulent_velocity
from anim.simulation.particles.kernels.vectors import Vector, add, dot, length
from anim.skinning.kernels.jit import callee, inline, jit

METHODS = ("explicit-euler", "symplectic-euler", "velocity-verlet", "rk4", "implicit-euler")  # their codes are indices


class UniformForces(NamedTuple):
    """Forces that are the same everywhere. gravity: m/s². linear_drag: 1/s, quadratic_drag: 1/m. wind: m/s."""

    gravity: Vector
    linear_drag: float
    quadratic_drag: float
    wind: Vector


class ForceField(NamedTuple):
    """All forces of a run.

    modes: (8, M) of the turbulence: wave vector in 1/m, amplitude in m/s, rate in 1/s, phase. scratch: (M,), of
    `turbulent_velocity`. attractors: (A, 2), strength in m/s² at the radius in m. centers: (S, A, 3) m at the ends of
    steps, or (1, A, 3). step: s. first: index of the step that begins at centers[0]. is_uniform: without turbulence and
    attractors.
    """

    uniform: UniformForces
    modes: Floats
    scratch: Floats
    attractors: Floats
    centers: Floats
    step: float
    first: int
    is_uniform: bool


@callee
def uniform_air(forces: UniformForces, t: float, x: Vector) -> Vector:
    """Return the velocity of the air in m/s: the wind."""
    return forces.wind


@callee
def uniform_acceleration(forces: UniformForces, t: float, x: Vector, v: Vector, air: Vector) -> Vector:
    """Return the acceleration in m/s² by gravity and drag. air: its velocity in m/s."""
    relative = add(v, -1.0, air)
    factor = forces.linear_drag
    if forces.quadratic_drag > 0.0:
        factor += forces.quadratic_drag * length(relative)
    return add(forces.gravity, -factor, relative)


@jit
def air_velocity(field: ForceField, t: float, x: Vector) -> Vector:
    """Return the velocity of the air in m/s: wind and turbulence."""
    return turbulent_velocity(field.modes, field.scratch, t, x, field.uniform.wind)


@callee
def acceleration(field: ForceField, t: float, x: Vector, v: Vector, air: Vector) -> Vector:
    """Return the acceleration in m/s² by all forces at t s. air: its velocity in m/s."""
    a = uniform_acceleration(field.uniform, t, x, v, air)
    for k in range(len(field.attractors)):
        towards = add(attractor_center(field, k, t), -1.0, x)
        a = add(a, pull_per_metre(field.attractors[k, 0], field.attractors[k, 1], length(towards)), towards)
    return a


@callee
def attractor_center(field: ForceField, k: int, t: float) -> Vector:
    """Return the center of an attractor at t s, linear between the ends of steps."""
    centers = field.centers
    last = len(centers) - 1
    at = min(max(t / field.step - field.first, 0.0), float(last))
    i = min(int(at), max(last - 1, 0))
    u, a, b = at - i, centers[i, k], centers[min(i + 1, last), k]
    return (a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1]), a[2] + u * (b[2] - a[2]))


@callee
def pull_per_metre(strength: float, radius: float, distance: float) -> float:
    """Return the acceleration towards an attractor over the distance: gravity of a ball, uniform inside."""
    return strength / radius if distance <= radius else strength * radius * radius / (distance * distance * distance)


@callee
def potential(field: ForceField, t: float, x: Vector) -> float:
    """Return the potential energy in J/kg of gravity, 0 at the origin, and of attractors, 0 far away."""
    energy = -dot(field.uniform.gravity, x)
    for k in range(len(field.attractors)):
        s, radius = field.attractors[k, 0], field.attractors[k, 1]
        d = length(add(attractor_center(field, k, t), -1.0, x))
        energy += 0.5 * s * (d * d / radius - 3 * radius) if d <= radius else -s * radius * radius / d
    return energy


@callee
def uniform_implicit_change(forces: UniformForces, t: float, x: Vector, v: Vector, h: float, air: Vector) -> Vector:
    """Return the change of velocity of one Newton step of implicit Euler under uniform forces."""
    a = uniform_acceleration(forces, t, x, v, air)
    return _solve(forces, add(v, -1.0, air), (h * a[0], h * a[1], h * a[2]), h, 0.0)


@callee
def implicit_change(field: ForceField, t: float, x: Vector, v: Vector, h: float, air: Vector) -> Vector:
    """Return the change of velocity of one Newton step of implicit Euler.

    It solves (I − h ∂a/∂v − h² ∂a/∂x) dv = h (a + h ∂a/∂x v), where attractors count without the part of their gradient
    that pushes outwards, and turbulence without gradient: the matrix stays positive definite.
    """
    stiffness = 0.0
    for k in range(len(field.attractors)):
        towards = add(attractor_center(field, k, t), -1.0, x)
        stiffness += max(pull_per_metre(field.attractors[k, 0], field.attractors[k, 1], length(towards)), 0.0)
    a = add(acceleration(field, t, x, v, air), -h * stiffness, v)
    return _solve(field.uniform, add(v, -1.0, air), (h * a[0], h * a[1], h * a[2]), h, stiffness)


@callee
def _solve(forces: UniformForces, relative: Vector, right: Vector, h: float, stiffness: float) -> Vector:
    """Solution of (diagonal · I + b r rᵀ) dv = right, r being the velocity relative to the air."""
    speed = length(relative)
    diagonal = 1.0 + h * (forces.linear_drag + forces.quadratic_drag * speed) + h * h * stiffness
    b = h * forces.quadratic_drag / max(speed, 1e-300)
    along = dot(relative, right) * b / (diagonal + b * speed * speed)
    return add((right[0] / diagonal, right[1] / diagonal, right[2] / diagonal), -along / diagonal, relative)


def _integrator(
    air_at: Callable[..., Vector], force: Callable[..., Vector], change: Callable[..., Vector]
) -> Callable[..., tuple[Vector, Vector, Vector]]:
    """Return the function of one step in this air, with this acceleration, and this change by implicit Euler.

    The default method has its forces inlined, which halves its time; that of all would double the time to compile.
    """
    inlined_air, inlined_force = inline(air_at.py_func), inline(force.py_func)  # type: ignore[attr-defined]

    @callee
    def integrate(
        forces: Any, method: int, t: float, x: Vector, v: Vector, h: float, air: Vector
    ) -> tuple[Vector, Vector, Vector]:
        """Return position, velocity, and that of the air, at t + h by METHODS[method]. air: its velocity at t."""
        if method == 0:
            v1 = add(v, h, force(forces, t, x, v, air))
            x1 = add(x, h, v)
        elif method == 1:
            v1 = add(v, h, force(forces, t, x, v, air))
            x1 = add(x, h, v1)
        elif method == 2:
            half = add(v, 0.5 * h, inlined_force(forces, t, x, v, air))
            x1 = add(x, h, half)
            air = inlined_air(forces, t + h, x1)
            return x1, add(half, 0.5 * h, inlined_force(forces, t + h, x1, half, air)), air
        elif method == 3:
            a1 = force(forces, t, x, v, air)
            v2 = add(v, 0.5 * h, a1)
            at = add(x, 0.5 * h, v)
            a2 = force(forces, t + 0.5 * h, at, v2, air_at(forces, t + 0.5 * h, at))
            v3 = add(v, 0.5 * h, a2)
            at = add(x, 0.5 * h, v2)
            a3 = force(forces, t + 0.5 * h, at, v3, air_at(forces, t + 0.5 * h, at))
            v4 = add(v, h, a3)
            at = add(x, h, v3)
            a4 = force(forces, t + h, at, v4, air_at(forces, t + h, at))
            x1 = add(x, h / 6, add(add(add(v, 2.0, v2), 2.0, v3), 1.0, v4))
            v1 = add(v, h / 6, add(add(add(a1, 2.0, a2), 2.0, a3), 1.0, a4))
        else:
            v1 = add(v, 1.0, change(forces, t, x, v, h, air))
            x1 = add(x, h, v1)
        return x1, v1, air_at(forces, t + h, x1)

    return integrate


integrate = _integrator(air_velocity, acceleration, implicit_change)
integrate_uniform = _integrator(uniform_air, uniform_acceleration, uniform_implicit_change)
