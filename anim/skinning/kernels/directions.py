"""Normals and tangents of a vertex: transformed by a matrix, or by scale-shear and rotation."""

from __future__ import annotations

from anim.skinning.kernels.jit import inline
from anim.skinning.kernels.lane_math import load, make_unit, rotate, transform_normal, transform_tangent
from anim.skinning.kernels.layout import FloatArray, OptionalArray


@inline
def move_normal(normal: FloatArray, source: FloatArray, matrix: FloatArray) -> None:
    """Set normal (3, L) to a vertex's own (3, m), transformed by matrices (12, L)."""
    load(normal, source)
    transform_normal(normal, matrix)
    make_unit(normal)


@inline
def move_tangent(tangent: FloatArray, source: FloatArray, matrix: FloatArray) -> None:
    """Set tangent (3, L) to a vertex's own (3, m), transformed by matrices (12, L)."""
    load(tangent, source)
    transform_tangent(tangent, matrix)
    make_unit(tangent)


@inline
def rotate_normal(normal: FloatArray, source: FloatArray, scale_shear: OptionalArray, rotation: FloatArray) -> None:
    """Set normal (3, L) to a vertex's own (3, m), after scale-shear (12, L) if any, rotated by (4, L)."""
    load(normal, source)
    if scale_shear is not None:
        transform_normal(normal, scale_shear)
    rotate(normal, rotation)
    make_unit(normal)


@inline
def rotate_tangent(tangent: FloatArray, source: FloatArray, scale_shear: OptionalArray, rotation: FloatArray) -> None:
    """Set tangent (3, L) to a vertex's own (3, m), after scale-shear (12, L) if any, rotated by (4, L)."""
    load(tangent, source)
    if scale_shear is not None:
        transform_tangent(tangent, scale_shear)
    rotate(tangent, rotation)
    make_unit(tangent)
