"""Kernel of linear blending for morphed points, or with normals and tangents."""

from __future__ import annotations

import numpy as np

from anim.skinning.kernels.directions import move_normal, move_tangent
from anim.skinning.kernels.jit import jit
from anim.skinning.kernels.lane_math import load, store, transform
from anim.skinning.kernels.layout import LANES, TILE, FloatArray, Influences, OptionalArray
from anim.skinning.kernels.weighted_sum import blend


@jit
def skin_linear(
    points: FloatArray,
    normals: OptionalArray,
    tangents: OptionalArray,
    influences: Influences,
    matrices: FloatArray,
    first: int,
    last: int,
    at: int,
    out: tuple[FloatArray, OptionalArray, OptionalArray],
) -> None:
    """Write (Σ w M) p, normals by the inverse transpose of Σ w M and tangents by it; matrices (J, 12, L).

    points (V, 3, m), normals and tangents the same or None; out: (n, all, 3) of each, columns at + v.
    """
    tiles, matrix = np.empty((3, TILE, 3, LANES), np.float32), np.empty((12, LANES), np.float32)
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            blend(matrix, matrices, influences, low + v, 12)
            point = tiles[0, v]
            load(point, points[low + v])
            transform(point, matrix)
            if normals is not None:
                move_normal(tiles[1, v], normals[low + v], matrix)
            if tangents is not None:
                move_tangent(tiles[2, v], tangents[low + v], matrix)
        store(tiles[0], count, at + low, out[0])
        if normals is not None:
            store(tiles[1], count, at + low, out[1])
        if tangents is not None:
            store(tiles[2], count, at + low, out[2])
