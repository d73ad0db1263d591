"""Signed distances, normals and velocities of obstacles, compiled; their poses are linear within a step."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.simulation.particles.kernels.vectors import (
    Rotation,
    Vector,
    add,
    dot,
    hermite,
    length,
    rotate,
)
from anim.skinning.kernels.jit import callee

FLOOR, CAPSULE, BOX = range(3)
BALL, MOVING = 4, 5  # columns of `shapes`
MIN_ADVANCE = 1 / 32  # of a step, between two checks of the distance
MAX_ITERATIONS, ROOT_M = 60, 1e-15  # of the search for an impact
TOUCH_M = 1e-10  # nearer than this, a particle is on the surface
TOUCH_M_S = 1e-9  # slower than this, it does not approach it
TIME_DIFFERENCE = 1e-3  # of a step, for the velocity of a surface
Pose: TypeAlias = tuple[Vector, Rotation]


class Solids(NamedTuple):
    """All obstacles of a run.

    shapes: (O, 6): FLOOR, which is a plane where it is turned, CAPSULE or BOX; of a capsule the radius and half its
    length along y, 0 for a ball, in m, and −1 to keep particles inside, else 1; or half the sizes of a box; the radius
    of the ball around it; 1 for a moving or turned one: others are along the axes. poses: (S, O, 7), center and
    rotation at the ends of steps, or (1, O, 7).
    """

    shapes: Floats
    poses: Floats


@callee
def is_moving(solids: Solids, k: int) -> bool:
    """Return whether obstacle k moves or is turned."""
    return bool(solids.shapes[k, MOVING] != 0.0)


@callee
def is_flat(solids: Solids, k: int) -> bool:
    """Return whether a particle can rest on obstacle k without moving."""
    return bool(solids.shapes[k, 0] != CAPSULE and solids.shapes[k, MOVING] == 0.0)


@callee
def pose_at(solids: Solids, k: int, i: int, u: float) -> Pose:
    """Return center and rotation of obstacle k at the fraction u of step i."""
    a = solids.poses[0, k]
    if not is_moving(solids, k):
        return (a[0], a[1], a[2]), (0.0, 0.0, 0.0, 1.0)
    last = len(solids.poses) - 1
    a, b = solids.poses[min(i, last), k], solids.poses[min(i + 1, last), k]
    w = 1.0 - u
    x, y, z, r = w * a[3] + u * b[3], w * a[4] + u * b[4], w * a[5] + u * b[5], w * a[6] + u * b[6]
    norm = np.sqrt(x * x + y * y + z * z + r * r)
    center = (w * a[0] + u * b[0], w * a[1] + u * b[1], w * a[2] + u * b[2])
    return center, (x / norm, y / norm, z / norm, r / norm)


@callee
def to_local(pose: Pose, x: Vector) -> Vector:
    """Return a point relative to a pose."""
    q = pose[1]
    return rotate((-q[0], -q[1], -q[2], q[3]), add(x, -1.0, pose[0]))


@callee
def to_world(pose: Pose, p: Vector) -> Vector:
    """Return the point of the world that is at p relative to a pose."""
    return add(pose[0], 1.0, rotate(pose[1], p))


@callee
def _from_axis(solids: Solids, k: int, p: Vector) -> Vector:
    """Vector from the nearest point of a capsule's axis."""
    half = float(solids.shapes[k, 2])
    return (p[0], p[1] - min(max(p[1], -half), half), p[2])


@callee
def local_distance(solids: Solids, k: int, p: Vector) -> float:
    """Return the signed distance in m, below 0 inside, of a point relative to obstacle k."""
    kind = solids.shapes[k, 0]
    if kind == FLOOR:
        return p[1]
    if kind == CAPSULE:
        return float(solids.shapes[k, 3]) * (length(_from_axis(solids, k, p)) - float(solids.shapes[k, 1]))
    x, y, z = abs(p[0]) - solids.shapes[k, 1], abs(p[1]) - solids.shapes[k, 2], abs(p[2]) - solids.shapes[k, 3]
    outside = length((max(x, 0.0), max(y, 0.0), max(z, 0.0)))
    return outside + float(min(max(x, y, z), 0.0))


@callee
def local_normal(solids: Solids, k: int, p: Vector) -> Vector:
    """Return the outward normal at the surface's point nearest to p, relative to obstacle k; up on an axis."""
    kind = solids.shapes[k, 0]
    if kind == FLOOR:
        return (0.0, 1.0, 0.0)
    if kind == CAPSULE:
        q = _from_axis(solids, k, p)
        d = length(q) * float(solids.shapes[k, 3])
        return (q[0] / d, q[1] / d, q[2] / d) if d != 0.0 else (0.0, 1.0, 0.0)
    x, y, z = abs(p[0]) - solids.shapes[k, 1], abs(p[1]) - solids.shapes[k, 2], abs(p[2]) - solids.shapes[k, 3]
    sx, sy, sz = -1.0 if p[0] < 0.0 else 1.0, -1.0 if p[1] < 0.0 else 1.0, -1.0 if p[2] < 0.0 else 1.0
    outside = length((max(x, 0.0), max(y, 0.0), max(z, 0.0)))
    if outside > 1e-9:  # from an edge or a corner
        return (sx * max(x, 0.0) / outside, sy * max(y, 0.0) / outside, sz * max(z, 0.0) / outside)
    if x >= y and x >= z:
        return (sx, 0.0, 0.0)
    return (0.0, sy, 0.0) if y >= z else (0.0, 0.0, sz)


@callee
def distance(solids: Solids, k: int, i: int, u: float, x: Vector) -> float:
    """Return the signed distance in m of a point from obstacle k at the fraction u of step i."""
    if is_moving(solids, k):
        return local_distance(solids, k, to_local(pose_at(solids, k, i, u), x))
    a = solids.poses[0, k]
    return local_distance(solids, k, (x[0] - a[0], x[1] - a[1], x[2] - a[2]))


@callee
def normal(solids: Solids, k: int, i: int, u: float, x: Vector) -> Vector:
    """Return the outward normal in the world."""
    pose = pose_at(solids, k, i, u)
    return rotate(pose[1], local_normal(solids, k, to_local(pose, x)))


@callee
def surface_velocity(solids: Solids, k: int, i: int, u: float, h: float, x: Vector) -> Vector:
    """Return the velocity in m/s of obstacle k at a point of the world. h: s, the whole step."""
    if not is_moving(solids, k):
        return (0.0, 0.0, 0.0)
    p = to_local(pose_at(solids, k, i, u), x)
    low, high = max(u - TIME_DIFFERENCE, 0.0), min(u + TIME_DIFFERENCE, 1.0)
    a, b = to_world(pose_at(solids, k, i, low), p), to_world(pose_at(solids, k, i, high), p)
    span = (high - low) * h
    return ((b[0] - a[0]) / span, (b[1] - a[1]) / span, (b[2] - a[2]) / span)


@callee
def is_on_face(solids: Solids, k: int, x: Vector, face: Vector) -> bool:
    """Return whether a point on a static obstacle is on its face with this normal."""
    if solids.shapes[k, 0] != BOX:
        return bool(solids.shapes[k, 0] == FLOOR)
    a = solids.poses[0, k]
    is_on = True
    for c in range(3):
        is_on &= bool(abs(x[c] - a[c]) <= solids.shapes[k, 1 + c]) or abs(face[c]) > 0.5
    return is_on


@callee
def impact_fraction(
    solids: Solids, k: int, i: int, f0: float, f1: float, step: float, h: float,
    x0: Vector, v0: Vector, x1: Vector, v1: Vector,
) -> float:  # fmt: skip
    """Return the fraction of a flight at which it meets obstacle k, or infinity.

    The flight is the cubic of h s between both ends, from the fraction f0 to f1 of step i of `step` s. It is marched by
    the distance to the surface, which no point of it can pass.
    """
    d0 = distance(solids, k, i, f0, x0)
    is_floor = solids.shapes[k, 0] == FLOOR and not is_moving(solids, k)
    d1 = distance(solids, k, i, f1, x1)
    if is_floor and d1 >= 0.0:  # gravity points down: who ends above was above
        return np.inf
    reach = _reach(solids, k, i, f0, f1, h, x0, v0, x1, v1)
    if d0 > reach:
        return np.inf
    u, previous, limit = 0.0, 0.0, 0.0
    if d0 <= TOUCH_M:
        approach = dot(add(v0, -1.0, surface_velocity(solids, k, i, f0, step, x0)), normal(solids, k, i, f0, x0))
        if approach < -TOUCH_M_S:
            return 0.0
        u, previous, limit = MIN_ADVANCE, 1e-3 * MIN_ADVANCE, -TOUCH_M  # leaves; may come back
    if is_floor:
        u, previous = 1.0, 1e-3 if d0 <= TOUCH_M else 0.0
    while True:
        d = d1 if u >= 1.0 else distance(solids, k, i, f0 + u * (f1 - f0), hermite(u, h, x0, v0, x1, v1))
        if d < limit:
            break
        if u >= 1.0:
            return np.inf
        previous = u
        u = min(1.0, u + max(d / reach, MIN_ADVANCE))
    return _root(solids, k, i, f0, f1, h, x0, v0, x1, v1, previous, u, limit)


@callee
def _root(
    solids: Solids, k: int, i: int, f0: float, f1: float, h: float,
    x0: Vector, v0: Vector, x1: Vector, v1: Vector, low: float, high: float, limit: float,
) -> float:  # fmt: skip
    """Fraction between low, outside, and high, inside, at which the distance is `limit`: by the Illinois method."""
    at_low = distance(solids, k, i, f0 + low * (f1 - f0), hermite(low, h, x0, v0, x1, v1)) - limit
    at_high = distance(solids, k, i, f0 + high * (f1 - f0), hermite(high, h, x0, v0, x1, v1)) - limit
    if at_low <= 0.0:
        return low
    side = 0
    for _ in range(MAX_ITERATIONS):
        middle = low + (high - low) * at_low / (at_low - at_high)
        at = distance(solids, k, i, f0 + middle * (f1 - f0), hermite(middle, h, x0, v0, x1, v1)) - limit
        if abs(at) < ROOT_M or not low < middle < high:
            return middle
        if at > 0.0:
            low, at_low = middle, at
            at_high *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            high, at_high = middle, at
            at_low *= 0.5 if side < 0 else 1.0
            side = -1
    return low


@callee
def _reach(
    solids: Solids, k: int, i: int, f0: float, f1: float, h: float,
    x0: Vector, v0: Vector, x1: Vector, v1: Vector,
) -> float:  # fmt: skip
    """Longest way in m of the particle and of the obstacle's surface towards each other over the flight."""
    way = 1.5 * max(h * length(v0), h * length(v1), length(add(x1, -1.0, x0))) + 1e-12
    if is_moving(solids, k):
        a, b = pose_at(solids, k, i, f0), pose_at(solids, k, i, f1)
        cosine = abs(a[1][0] * b[1][0] + a[1][1] * b[1][1] + a[1][2] * b[1][2] + a[1][3] * b[1][3])
        angle = 2 * np.arccos(min(cosine, 1.0))
        way += 1.5 * (length(add(b[0], -1.0, a[0])) + angle * (float(solids.shapes[k, BALL]) + way))
    return way


@callee
def containing(solids: Solids, i: int, f: float, x: Vector) -> int:
    """Return the bits of the obstacles that a point is in."""
    found = 0
    for k in range(len(solids.shapes)):
        if distance(solids, k, i, f, x) < -TOUCH_M:
            found |= 1 << k
    return found
