"""Collisions of cloth with spheres, capsules, planes and a floor, with Coulomb's friction."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.skinning.kernels.jit import inline, jit

OUTSIDE, INSIDE, PLANE = 1.0, -1.0, 0.0  # kinds of colliders


@inline
def _contact(x: float, y: float, z: float, c: Floats) -> tuple[float, float, float, float, float]:
    """Distance of a point to a collider (8,), negative inside, the unit normal there, and the fraction of its axis."""
    if c[7] == PLANE:
        nx, ny, nz = c[3], c[4], c[5]
        return (x - c[0]) * nx + (y - c[1]) * ny + (z - c[2]) * nz, nx, ny, nz, 0.0
    bx, by, bz = c[3] - c[0], c[4] - c[1], c[5] - c[2]
    square = bx * bx + by * by + bz * bz
    t = 0.0
    if square > 0.0:
        t = min(max(((x - c[0]) * bx + (y - c[1]) * by + (z - c[2]) * bz) / square, 0.0), 1.0)
    dx, dy, dz = x - c[0] - t * bx, y - c[1] - t * by, z - c[2] - t * bz
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    if length == 0.0:
        return -c[7] * c[6], 0.0, 1.0, 0.0, t
    s = c[7] / length
    return c[7] * (length - c[6]), s * dx, s * dy, s * dz, t


@jit
def push_out(
    p: Floats,
    old: Floats,
    w: Floats,
    colliders: Floats,
    before: Floats,
    floor: float,
    thickness: float,
    friction: float,
) -> None:
    """Move points out of colliders (C, 8) and above the floor, with Coulomb's friction.

    A collider is both centers, the radius and OUTSIDE or INSIDE, the side that points stay on; or a point, the unit
    normal, 0 and PLANE. old: positions at the start of the step; before: the colliders then, so that friction drags
    points along.
    """
    for i in range(len(p)):
        if w[i] == 0.0:
            continue
        for k in range(len(colliders)):
            c, b = colliders[k], before[k]
            distance, nx, ny, nz, t = _contact(p[i, 0], p[i, 1], p[i, 2], c)
            depth = thickness - distance
            if depth <= 0.0:
                continue
            p[i, 0] += nx * depth
            p[i, 1] += ny * depth
            p[i, 2] += nz * depth
            if c[7] == PLANE:
                mx, my, mz = c[0] - b[0], c[1] - b[1], c[2] - b[2]
            else:
                mx = c[0] - b[0] + t * (c[3] - c[0] - b[3] + b[0])
                my = c[1] - b[1] + t * (c[4] - c[1] - b[4] + b[1])
                mz = c[2] - b[2] + t * (c[5] - c[2] - b[5] + b[2])
            sx, sy, sz = p[i, 0] - old[i, 0] - mx, p[i, 1] - old[i, 1] - my, p[i, 2] - old[i, 2] - mz
            along = sx * nx + sy * ny + sz * nz
            sx, sy, sz = sx - along * nx, sy - along * ny, sz - along * nz
            slip = np.sqrt(sx * sx + sy * sy + sz * sz)
            if slip > 0.0:
                s = min(1.0, friction * depth / slip)
                p[i, 0] -= s * sx
                p[i, 1] -= s * sy
                p[i, 2] -= s * sz
        depth = floor + thickness - p[i, 1]
        if depth > 0.0:
            p[i, 1] += depth
            sx, sz = p[i, 0] - old[i, 0], p[i, 2] - old[i, 2]
            slip = np.sqrt(sx * sx + sz * sz)
            if slip > 0.0:
                s = min(1.0, friction * depth / slip)
                p[i, 0] -= s * sx
                p[i, 2] -= s * sz


@jit
def deepest_penetration(frames: Floats, w: Floats, colliders: Floats, floor: float) -> float:
    """Return the largest depth in m of free points (F, P, 3) inside colliders (F, C, 8) or below the floor."""
    deepest = 0.0
    for f in range(len(frames)):
        for i in range(frames.shape[1]):
            if w[i] == 0.0:
                continue
            deepest = max(deepest, floor - frames[f, i, 1])
            for k in range(colliders.shape[1]):
                distance, _, _, _, _ = _contact(frames[f, i, 0], frames[f, i, 1], frames[f, i, 2], colliders[f, k])
                deepest = max(deepest, -distance)
    return deepest
