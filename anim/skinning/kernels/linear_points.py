"""Kernel of linear blending for constant points without directions, the fastest case."""

from __future__ import annotations

import numpy as np

from anim.skinning.kernels.jit import jit
from anim.skinning.kernels.layout import LANES, TILE, FloatArray, Influences


@jit
def skin_linear_points(
    coefficients: FloatArray,
    influences: Influences,
    matrices: FloatArray,
    first: int,
    last: int,
    at: int,
    positions: FloatArray,
) -> None:
    """Write Σ w M p of vertices first … last into columns at + v of positions (n, all, 3).

    coefficients: (E, 4), w·(x, y, z, 1). matrices: (J, 4, 3L) columns, frame by frame x, y, z.
    """
    tile = np.empty((TILE, 3 * LANES), np.float32)
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            moved = tile[v]
            begin, end = influences.start[low + v], influences.start[low + v + 1]
            if begin == end:
                moved[:] = 0
                continue
            a, c = matrices[influences.joint[begin]], coefficients[begin]
            x, y, z, w = c[0], c[1], c[2], c[3]
            for i in range(3 * LANES):
                moved[i] = x * a[0, i] + y * a[1, i] + z * a[2, i] + w * a[3, i]
            for e in range(begin + 1, end):
                a, c = matrices[influences.joint[e]], coefficients[e]
                x, y, z, w = c[0], c[1], c[2], c[3]
                for i in range(3 * LANES):
                    moved[i] += x * a[0, i] + y * a[1, i] + z * a[2, i] + w * a[3, i]
        for f in range(len(positions)):
            frame = positions[f]
            for v in range(count):
                frame[at + low + v, 0] = tile[v, 3 * f]
                frame[at + low + v, 1] = tile[v, 3 * f + 1]
                frame[at + low + v, 2] = tile[v, 3 * f + 2]
