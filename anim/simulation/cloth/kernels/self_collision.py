"""Collision of cloth with itself, between points, on a hashed grid. Source: Teschner et al., 2003."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats, Ints
from anim.skinning.kernels.jit import jit


@jit
def _cell(x: int, y: int, z: int, size: int) -> int:
    return abs((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) % size


@jit
def _sort_by_cell(p: Floats, width: float, starts: Ints, entries: Ints) -> None:
    """Fill the first entry of each cell (size + 1,), and the points of all cells (P,)."""
    size = len(starts) - 1
    cells = np.empty(len(p), np.int64)
    starts[:] = 0
    for i in range(len(p)):
        x, y, z = np.floor(p[i, 0] / width), np.floor(p[i, 1] / width), np.floor(p[i, 2] / width)
        cells[i] = _cell(int(x), int(y), int(z), size)
        starts[cells[i] + 1] += 1
    for k in range(size):
        starts[k + 1] += starts[k]
    filled = starts[:-1].copy()
    for i in range(len(p)):
        entries[filled[cells[i]]] = i
        filled[cells[i]] += 1


@jit
def separate_points(p: Floats, w: Floats, at_rest: Floats, thickness: float) -> None:
    """Push points (P, 3) apart that are nearer than `thickness` m, and nearer than at rest; w: inverse masses."""
    size = 2 * len(p)
    starts, entries = np.empty(size + 1, np.int64), np.empty(len(p), np.int64)
    _sort_by_cell(p, thickness, starts, entries)
    for i in range(len(p)):
        cx, cy, cz = (
            int(np.floor(p[i, 0] / thickness)),
            int(np.floor(p[i, 1] / thickness)),
            int(np.floor(p[i, 2] / thickness)),
        )
        for x in range(cx - 1, cx + 2):
            for y in range(cy - 1, cy + 2):
                for z in range(cz - 1, cz + 2):
                    cell = _cell(x, y, z, size)
                    for m in range(starts[cell], starts[cell + 1]):
                        j = entries[m]
                        if j <= i or w[i] + w[j] == 0.0:
                            continue
                        dx, dy, dz = p[i, 0] - p[j, 0], p[i, 1] - p[j, 1], p[i, 2] - p[j, 2]
                        square = dx * dx + dy * dy + dz * dz
                        if square >= thickness * thickness or square == 0.0:
                            continue
                        rx, ry, rz = (
                            at_rest[i, 0] - at_rest[j, 0],
                            at_rest[i, 1] - at_rest[j, 1],
                            at_rest[i, 2] - at_rest[j, 2],
                        )
                        least = min(thickness, np.sqrt(rx * rx + ry * ry + rz * rz))
                        length = np.sqrt(square)
                        if length >= least:
                            continue
                        s = (least - length) / length / (w[i] + w[j])
                        p[i, 0] += s * w[i] * dx
                        p[i, 1] += s * w[i] * dy
                        p[i, 2] += s * w[i] * dz
                        p[j, 0] -= s * w[j] * dx
                        p[j, 1] -= s * w[j] * dy
                        p[j, 2] -= s * w[j] * dz
