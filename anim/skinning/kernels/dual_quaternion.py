"""Kernel of dual-quaternion skinning."""

from __future__ import annotations

import numpy as np

from anim.skinning.kernels.directions import rotate_normal, rotate_tangent
from anim.skinning.kernels.jit import inline, jit
from anim.skinning.kernels.lane_math import TWO, add_scaled, load, store, transform
from anim.skinning.kernels.layout import LANES, TILE, FloatArray, Influences, OptionalArray, ScaleShear
from anim.skinning.kernels.weighted_sum import blend, blend_quaternions


@jit
def skin_dual_quaternion(
    points: FloatArray,
    normals: OptionalArray,
    tangents: OptionalArray,
    influences: Influences,
    duals: FloatArray,
    scale_shears: ScaleShear | None,
    first: int,
    last: int,
    at: int,
    out: tuple[FloatArray, OptionalArray, OptionalArray],
) -> None:
    """Write points moved by blended dual quaternions (J, 8, L); with scale_shears (J, 12, L).

    After scale_shears the points get the vertex's scale times its pivot, and the dual quaternions that scale times
    their last four. points (V, 3, m), normals and tangents the same or None; out: (n, all, 3) of each, columns at + v.
    """
    tiles, signed = np.empty((3, TILE, 3, LANES), np.float32), np.empty((influences.max_count, LANES), np.float32)
    dual = np.empty((12, LANES), np.float32)
    scale_shear: OptionalArray = None if scale_shears is None else np.empty((15, LANES), np.float32)
    scale = np.empty((1, LANES), np.float32)
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            if influences.start[low + v] == influences.start[low + v + 1]:
                tiles[:, v] = 0
                continue
            blend_quaternions(dual, duals, influences, low + v, 8 if scale_shears is None else 12, signed)
            point = tiles[0, v]
            load(point, points[low + v])
            if scale_shears is not None:
                blend(scale_shear, scale_shears.matrices, influences, low + v, 15)
                blend(scale, scale_shears.scales, scale_shears.scale_influences, low + v, 1)
                transform(point, scale_shear)
                add_scaled(point, scale_shear[12:], scale)
                add_scaled(dual[4:8], dual[8:], scale)
            _move(point, dual)
            if normals is not None:
                rotate_normal(tiles[1, v], normals[low + v], scale_shear, dual)
            if tangents is not None:
                rotate_tangent(tiles[2, v], tangents[low + v], scale_shear, dual)
        store(tiles[0], count, at + low, out[0])
        if normals is not None:
            store(tiles[1], count, at + low, out[1])
        if tangents is not None:
            store(tiles[2], count, at + low, out[2])


@inline
def _move(p: FloatArray, b: FloatArray) -> None:
    """Transform points by dual quaternions (8, L) of any length but 0."""
    for f in range(LANES):
        x, y, z, w = b[0, f], b[1, f], b[2, f], b[3, f]
        dx, dy, dz, dw = b[4, f], b[5, f], b[6, f], b[7, f]
        two = TWO / (x * x + y * y + z * z + w * w)
        px, py, pz = p[0, f], p[1, f], p[2, f]
        cx = y * pz - z * py + w * px + dx
        cy = z * px - x * pz + w * py + dy
        cz = x * py - y * px + w * pz + dz
        p[0, f] = px + two * (y * cz - z * cy + w * dx - dw * x)
        p[1, f] = py + two * (z * cx - x * cz + w * dy - dw * y)
        p[2, f] = pz + two * (x * cy - y * cx + w * dz - dw * z)
