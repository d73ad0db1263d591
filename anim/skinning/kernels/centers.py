"""Kernel of skinning with centers of rotation."""

from __future__ import annotations

import numpy as np

from anim.skinning.kernels.directions import rotate_normal, rotate_tangent
from anim.skinning.kernels.jit import inline, jit
from anim.skinning.kernels.lane_math import add_scaled, load, rotate, store, transform
from anim.skinning.kernels.layout import LANES, TILE, FloatArray, Influences, OptionalArray, ScaleShear
from anim.skinning.kernels.weighted_sum import blend, blend_quaternions


@jit
def skin_centers(
    points: FloatArray,
    normals: OptionalArray,
    tangents: OptionalArray,
    centers: FloatArray,
    influences: Influences,
    rotations: FloatArray,
    rigids: FloatArray,
    scale_shears: ScaleShear | None,
    first: int,
    last: int,
    at: int,
    out: tuple[FloatArray, OptionalArray, OptionalArray],
) -> None:
    """Write points rotated about centers (V, 3, 1), which move by linear blending.

    centers: NaN if the point is its own center. rotations: (J, 4, L) quaternions. rigids: (J, 12, L), the same motions
    as matrices; with scale_shears (J, 15, L), where the vertex's scale times the last three is added to the
    translations. Other parameters as in skin_dual_quaternion.
    """
    tiles, signed = np.empty((3, TILE, 3, LANES), np.float32), np.empty((influences.max_count, LANES), np.float32)
    rotation, matrix = np.empty((4, LANES), np.float32), np.empty((15, LANES), np.float32)
    scale_shear: OptionalArray = None if scale_shears is None else np.empty((15, LANES), np.float32)
    center, scale = np.empty((3, LANES), np.float32), np.empty((1, LANES), np.float32)
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            if influences.start[low + v] == influences.start[low + v + 1]:
                tiles[:, v] = 0
                continue
            blend_quaternions(rotation, rotations, influences, low + v, 4, signed)
            blend(matrix, rigids, influences, low + v, 12 if scale_shears is None else 15)
            point = tiles[0, v]
            load(point, points[low + v])
            load(center, points[low + v] if np.isnan(centers[low + v, 0, 0]) else centers[low + v])
            if scale_shears is not None:
                blend(scale_shear, scale_shears.matrices, influences, low + v, 15)
                blend(scale, scale_shears.scales, scale_shears.scale_influences, low + v, 1)
                transform(point, scale_shear)
                transform(center, scale_shear)
                add_scaled(point, scale_shear[12:], scale)
                add_scaled(center, scale_shear[12:], scale)
                for i in range(3):
                    add_scaled(matrix[4 * i + 3 : 4 * i + 4], matrix[12 + i : 13 + i], scale)
            _rotate_about(point, center, rotation, matrix)
            if normals is not None:
                rotate_normal(tiles[1, v], normals[low + v], scale_shear, rotation)
            if tangents is not None:
                rotate_tangent(tiles[2, v], tangents[low + v], scale_shear, rotation)
        store(tiles[0], count, at + low, out[0])
        if normals is not None:
            store(tiles[1], count, at + low, out[1])
        if tangents is not None:
            store(tiles[2], count, at + low, out[2])


@inline
def _rotate_about(p: FloatArray, center: FloatArray, rotation: FloatArray, matrix: FloatArray) -> None:
    """Rotate points about a center that moves by matrices."""
    for i in range(3):
        for f in range(LANES):
            p[i, f] -= center[i, f]
    rotate(p, rotation)
    transform(center, matrix)
    for i in range(3):
        for f in range(LANES):
            p[i, f] += center[i, f]
