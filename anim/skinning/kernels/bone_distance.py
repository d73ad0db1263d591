"""Distance of vertices from the bones between their joints, and a clamp of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Ints
from anim.skinning.kernels.jit import jit
from anim.skinning.kernels.layout import FloatArray


@jit
def squared_bone_distance(
    positions: FloatArray,
    at: int,
    start: Ints,
    joint: NDArray[np.int32],
    link_start: Ints,
    tips: Ints,
    joints: FloatArray,
    squared: FloatArray,
) -> None:
    """Write the squared distance (n, V) of vertices from the nearest of their bones.

    Vertices are columns `at` + v of positions.
    """
    for f in range(len(positions)):
        for v in range(squared.shape[1]):
            p = positions[f, at + v]
            squared[f, v] = _nearest(p, joints[f], joint, start[v], start[v + 1], link_start, tips)[0]


@jit
def clamp_to_bones(
    positions: FloatArray,
    at: int,
    start: Ints,
    joint: NDArray[np.int32],
    link_start: Ints,
    tips: Ints,
    joints: FloatArray,
    scales: FloatArray,
    distance: FloatArray,
    weight: FloatArray,
    first: int,
    last: int,
) -> None:
    """Move vertices first … last towards their nearest bone if they are farther from it than at rest."""
    for f in range(len(positions)):
        for v in range(first, last):
            if weight[v] == 0:
                continue
            p = positions[f, at + v]
            squared, x, y, z = _nearest(p, joints[f], joint, start[v], start[v + 1], link_start, tips)
            allowed = distance[v] * scales[f, joint[start[v]]]
            if squared <= allowed * allowed:
                continue
            pull = weight[v] * (np.float32(1) - allowed / np.sqrt(squared))
            p[0] += pull * (x - p[0])
            p[1] += pull * (y - p[1])
            p[2] += pull * (z - p[2])


@jit
def _nearest(
    p: FloatArray, joints: FloatArray, joint: NDArray[np.int32], begin: int, end: int, link_start: Ints, tips: Ints
) -> tuple[Any, Any, Any, Any]:
    """Squared distance to the nearest bone of influences begin … end, and the point on it."""
    best = np.float32(np.inf)
    nx, ny, nz = p[0], p[1], p[2]
    for e in range(begin, end):
        j = joint[e]
        ax, ay, az = joints[j, 0], joints[j, 1], joints[j, 2]
        for b in range(link_start[j], link_start[j + 1]):
            t = tips[b]
            dx, dy, dz = joints[t, 0] - ax, joints[t, 1] - ay, joints[t, 2] - az
            length = dx * dx + dy * dy + dz * dz
            along = (p[0] - ax) * dx + (p[1] - ay) * dy + (p[2] - az) * dz
            u = min(max(along / length, np.float32(0)), np.float32(1)) if length > 0 else np.float32(0)
            x, y, z = ax + u * dx, ay + u * dy, az + u * dz
            squared = (p[0] - x) ** 2 + (p[1] - y) ** 2 + (p[2] - z) ** 2
            if squared < best:
                best = squared
                nx, ny, nz = x, y, z
    return best, nx, ny, nz
