"""Contact of a particle with a surface: rebound with friction, and sliding; compiled."""

from __future__ import annotations

from typing import NamedTuple

from anim.arrays import Floats
from anim.simulation.particles.kernels.force_field import ForceField, acceleration, air_velocity
from anim.simulation.particles.kernels.recording import add_energy
from anim.simulation.particles.kernels.solids import (
    Solids,
    distance,
    normal,
    pose_at,
    surface_velocity,
    to_local,
    to_world,
)
from anim.simulation.particles.kernels.vectors import Vector, add, dot, length
from anim.skinning.kernels.jit import callee

MIN_FLIGHT_S = 4e-3  # of a bounce, 20 µm high; whatever the step, so that it doesn't change the result
ORIGIN = (0.0, 0.0, 0.0)


class Grid(NamedTuple):
    """Steps and rules of a run.

    step: s. first: index of the first step; those before 0 are not written. num_steps: from 0 on. duration: s.
    substeps: of a frame. method: index in METHODS. has_frames: write a key per frame; else paths are parabolas between
    events. can_sleep: forces don't change with time. can_rest: obstacles don't move, so that a particle at rest on one
    needs no key per frame.
    """

    step: float
    first: int
    num_steps: int
    duration: float
    substeps: int
    method: int
    has_frames: bool
    can_sleep: bool
    can_rest: bool
    restitution: float
    friction: float


@callee
def respond(v: Vector, moving: Vector, face: Vector, a: Vector, grid: Grid) -> tuple[Vector, bool]:
    """Return the velocity after an impact, by restitution and Coulomb's friction, and whether the particle stays.

    It stays if it would come back at once. moving: velocity of the surface.
    """
    relative = add(v, -1.0, moving)
    approach = dot(relative, face)
    tangential = add(relative, -approach, face)
    speed = length(tangential)
    pull = -dot(a, face)
    bounce = max(-grid.restitution * approach, 0.0)
    stays = pull > 0.0 and 2 * bounce < pull * MIN_FLIGHT_S
    if stays:
        bounce = 0.0
    factor = max(1 - grid.friction * max(bounce - approach, 0.0) / max(speed, 1e-300), 0.0)
    return add(add(moving, factor, tangential), bounce, face), stays


@callee
def slide_face(
    a: Vector, face: Vector, h: float, x: Vector, v: Vector, friction: float
) -> tuple[float, Vector, Vector, bool, bool]:
    """Slide on a flat static face, exact for a constant acceleration: Coulomb's friction against the other forces.

    Returns the time until it stops, at most h, position and velocity then, whether it stops, and whether it stays.
    """
    push = dot(a, face)
    along = add(a, -push, face)
    speed, pull = length(v), length(along)
    grip = friction * max(-push, 0.0)
    if speed == 0.0 and pull <= grip:
        return h, x, ORIGIN, False, True
    d, size = (v, speed) if speed > 0.0 else (along, pull)
    total = add(along, -grip / size, d)
    slowing = -dot(total, d) / size
    if speed > 0.0 and slowing > 0.0 and speed < slowing * h:
        t = speed / slowing
        return t, add(add(x, t, v), 0.5 * t * t, total), ORIGIN, True, pull <= grip
    return h, add(add(x, h, v), 0.5 * h * h, total), add(v, h, total), False, False


@callee
def slide_surface(
    k: int, i: int, f0: float, t: float, h: float, x: Vector, v: Vector, field: ForceField, solids: Solids, grid: Grid
) -> tuple[bool, Vector, Vector]:
    """Take one step of Moreau's time stepping on a curved or moving surface: false for a particle that leaves it.

    The velocity loses what points into the surface at the end of the step, and Coulomb's friction acts on its impulse.
    """
    f1 = f0 + h / grid.step
    v1 = add(v, h, acceleration(field, t, x, v, air_velocity(field, t, x)))
    x1 = add(x, h, v1)
    face, moving = normal(solids, k, i, f1, x1), surface_velocity(solids, k, i, f1, grid.step, x1)
    relative = add(v1, -1.0, moving)
    approach = dot(relative, face)
    if approach > 0.0:
        return False, x, v
    tangential = add(relative, -approach, face)
    speed = length(tangential)
    factor = max(1 + grid.friction * approach / max(speed, 1e-300), 0.0)
    if factor == 0.0:  # moves with the surface
        x1 = to_world(pose_at(solids, k, i, f1), to_local(pose_at(solids, k, i, f0), x))
        return True, x1, surface_velocity(solids, k, i, f1, grid.step, x1)
    v1 = add(moving, factor, tangential)
    x1 = add(x, h, v1)
    return True, add(x1, -distance(solids, k, i, f1, x1), normal(solids, k, i, f1, x1)), v1


@callee
def rest(
    field: ForceField, grid: Grid, face: Vector, n: int, last: int, x: Vector, energies: Floats
) -> int:  # fmt: skip
    """Return the step from n on at which a particle at rest on a face begins to slide or leaves it, at most `last`."""
    while n < last:
        t = n * grid.step
        a = acceleration(field, t, x, ORIGIN, air_velocity(field, t, x))
        push = -dot(a, face)
        if push < 0.0 or length(add(a, push, face)) > grid.friction * push:
            break
        n += 1
        if n > 0 and n % grid.substeps == 0:
            add_energy(energies, n // grid.substeps, field, n * grid.step, x, ORIGIN)
    return n
