"""Boxes and spheres around shapes, computed once for the shapes of one scene: many bodies may share a large mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, freeze
from anim.simulation.rigid_bodies.description import Shape
from anim.simulation.rigid_bodies.shapes import surface_points


class ShapeExtent(NamedTuple):
    """Box and sphere around a shape, in its collider's frame. A plane has none: sizes and radius are 0.

    center: (3,) m, read-only; of points, the middle of their box. half_sizes: (3,) m of the box, read-only.
    radius: m, of the sphere around `center`. reach: m, largest distance of a point from the collider's origin.
    """

    center: Floats
    half_sizes: Floats
    radius: float
    reach: float


class ShapeExtents:
    """Extents of the shapes of one scene, which end with it."""

    def __init__(self) -> None:
        self._found: dict[Shape, ShapeExtent] = {}

    def of(self, shape: Shape) -> ShapeExtent:
        """Return the extent of a shape: the same object for the same shape."""
        if shape not in self._found:
            self._found[shape] = shape_extent(shape)
        return self._found[shape]


def shape_extent(shape: Shape) -> ShapeExtent:
    """Return the box and the sphere around a shape."""
    if shape.kind in ("hull", "mesh"):
        low, high = shape.points.min(axis=0), shape.points.max(axis=0)
        center = (low + high) / 2
        radius = float(np.linalg.norm(shape.points - center, axis=1).max())
        reach = float(np.linalg.norm(shape.points, axis=1).max())
        return ShapeExtent(freeze(center), freeze((high - low) / 2), radius, reach)
    center, offset = np.array(shape.center), float(np.linalg.norm(shape.center))
    half_sizes, radius = _around_center(shape)
    reach = offset + radius
    return ShapeExtent(freeze(center), freeze(half_sizes), reach - offset, reach)


def _around_center(shape: Shape) -> tuple[Floats, float]:
    """Half sizes (3,) of the box, and radius of the sphere, around the center of a shape without points."""
    if shape.kind == "plane":
        return np.zeros(3), 0.0
    if shape.kind == "sphere":
        return np.full(3, shape.size[0]), shape.size[0]
    if shape.kind == "box":
        return np.array(shape.size) / 2, float(np.linalg.norm(shape.size)) / 2
    points = surface_points(shape)
    return np.abs(points).max(axis=0), float(np.linalg.norm(points, axis=1).max())
