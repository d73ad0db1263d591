"""Kernel steps on a vertex: points and normals (3, L), matrices (12, L) row-major, quaternions (4, L)."""

from __future__ import annotations

import numpy as np

from anim.skinning.kernels.jit import inline
from anim.skinning.kernels.layout import LANES, FloatArray

MIN_LENGTH = np.float32(1e-30)
ONE, TWO = np.float32(1), np.float32(2)


@inline
def load(row: FloatArray, source: FloatArray) -> None:
    """Copy (3, m) into (3, L); a single column is repeated."""
    alone = source.shape[1] == 1
    for i in range(3):
        for f in range(LANES):
            row[i, f] = source[i, 0 if alone else f]


@inline
def add_scaled(p: FloatArray, q: FloatArray, scale: FloatArray) -> None:
    """Add rows q times scale (1, L) to all rows of p."""
    for i in range(p.shape[0]):
        for f in range(LANES):
            p[i, f] += scale[0, f] * q[i, f]


@inline
def transform(p: FloatArray, m: FloatArray) -> None:
    """Transform points by matrices."""
    for f in range(LANES):
        x, y, z = p[0, f], p[1, f], p[2, f]
        p[0, f] = m[0, f] * x + m[1, f] * y + m[2, f] * z + m[3, f]
        p[1, f] = m[4, f] * x + m[5, f] * y + m[6, f] * z + m[7, f]
        p[2, f] = m[8, f] * x + m[9, f] * y + m[10, f] * z + m[11, f]


@inline
def transform_tangent(p: FloatArray, m: FloatArray) -> None:
    """Transform directions in the surface."""
    for f in range(LANES):
        x, y, z = p[0, f], p[1, f], p[2, f]
        p[0, f] = m[0, f] * x + m[1, f] * y + m[2, f] * z
        p[1, f] = m[4, f] * x + m[5, f] * y + m[6, f] * z
        p[2, f] = m[8, f] * x + m[9, f] * y + m[10, f] * z


@inline
def transform_normal(p: FloatArray, m: FloatArray) -> None:
    """Transform normals by the cofactors, with the sign of the determinant.

    That is the inverse transpose times |det|, without a division; outside stays outside.
    """
    for f in range(LANES):
        x, y, z = p[0, f], p[1, f], p[2, f]
        cx = m[5, f] * m[10, f] - m[6, f] * m[9, f]
        cy = m[6, f] * m[8, f] - m[4, f] * m[10, f]
        cz = m[4, f] * m[9, f] - m[5, f] * m[8, f]
        volume = m[0, f] * cx + m[1, f] * cy + m[2, f] * cz
        sign = -ONE if volume < 0 else ONE
        nx = cx * x + cy * y + cz * z
        ny = (m[2, f] * m[9, f] - m[1, f] * m[10, f]) * x
        ny += (m[0, f] * m[10, f] - m[2, f] * m[8, f]) * y
        ny += (m[1, f] * m[8, f] - m[0, f] * m[9, f]) * z
        nz = (m[1, f] * m[6, f] - m[2, f] * m[5, f]) * x
        nz += (m[2, f] * m[4, f] - m[0, f] * m[6, f]) * y
        nz += (m[0, f] * m[5, f] - m[1, f] * m[4, f]) * z
        p[0, f] = nx * sign
        p[1, f] = ny * sign
        p[2, f] = nz * sign


@inline
def rotate(p: FloatArray, b: FloatArray) -> None:
    """Rotate by quaternions of any length but 0."""
    for f in range(LANES):
        x, y, z, w = b[0, f], b[1, f], b[2, f], b[3, f]
        px, py, pz = p[0, f], p[1, f], p[2, f]
        cx = y * pz - z * py + w * px
        cy = z * px - x * pz + w * py
        cz = x * py - y * px + w * pz
        two = TWO / (x * x + y * y + z * z + w * w)
        p[0, f] = px + two * (y * cz - z * cy)
        p[1, f] = py + two * (z * cx - x * cz)
        p[2, f] = pz + two * (x * cy - y * cx)


@inline
def make_unit(p: FloatArray) -> None:
    """Scale to length 1; zero vectors stay 0."""
    for f in range(LANES):
        x, y, z = p[0, f], p[1, f], p[2, f]
        scale = ONE / max(np.sqrt(x * x + y * y + z * z), MIN_LENGTH)
        p[0, f] = x * scale
        p[1, f] = y * scale
        p[2, f] = z * scale


@inline
def store(tile: FloatArray, count: int, at: int, out: FloatArray) -> None:
    """Write `count` vertices of a tile into columns from `at` of out (n, all, 3).

    Frames beyond n are padding.
    """
    for f in range(len(out)):
        frame = out[f]
        for v in range(count):
            frame[at + v, 0] = tile[v, 0, f]
            frame[at + v, 1] = tile[v, 1, f]
            frame[at + v, 2] = tile[v, 2, f]
