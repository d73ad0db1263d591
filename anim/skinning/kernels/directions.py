"""Normals and tangents of a vertex: along with a matrix, or with a stretch and a rotation."""

from __future__ import annotations

from anim.skinning.kernels.jit import inline
from anim.skinning.kernels.lane_math import load, make_unit, rotate, transform_normal, transform_tangent
from anim.skinning.kernels.layout import FloatArray, OptionalArray


@inline
def move_normal(normal: FloatArray, source: FloatArray, matrix: FloatArray) -> None:
    """Set normal (3, L) to a vertex's own (3, m), moved by matrices (12, L)."""
    load(normal, source)
    transform_normal(normal, matrix)
    make_unit(normal)


@inline
def move_tangent(tangent: FloatArray, source: FloatArray, matrix: FloatArray) -> None:
    """Set tangent (3, L) to a vertex's own (3, m), moved by matrices (12, L)."""
    load(tangent, source)
    transform_tangent(tangent, matrix)
    make_unit(tangent)


@inline
def rotate_normal(normal: FloatArray, source: FloatArray, stretch: OptionalArray, rotation: FloatArray) -> None:
    """Set normal (3, L) to a vertex's own (3, m), after a stretch (12, L) if there is one, rotated by (4, L)."""
    load(normal, source)
    if stretch is not None:
        transform_normal(normal, stretch)
    rotate(normal, rotation)
    make_unit(normal)


@inline
def rotate_tangent(tangent: FloatArray, source: FloatArray, stretch: OptionalArray, rotation: FloatArray) -> None:
    """Set tangent (3, L) to a vertex's own (3, m), after a stretch (12, L) if there is one, rotated by (4, L)."""
    load(tangent, source)
    if stretch is not None:
        transform_tangent(tangent, stretch)
    rotate(tangent, rotation)
    make_unit(tangent)
