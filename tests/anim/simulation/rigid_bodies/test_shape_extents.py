"""Boxes and spheres around shapes, and their end with the scene."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest
from numpy.typing import ArrayLike

from anim.simulation.rigid_bodies.description import Shape
from anim.simulation.rigid_bodies.shape_extents import ShapeExtents, shape_extent
from tests.anim.simulation.rigid_bodies.cases import body, ground, needs_rapier, run

CORNERS = np.array([[1.0, 0, 0], [3, 0, 0], [1, 4, 0], [1, 0, 4]])


@pytest.mark.parametrize(
    ("shape", "center", "half_sizes", "radius", "reach"),
    [
        (Shape("sphere", (0.5,), center=(0, 3, 4)), (0, 3, 4), (0.5, 0.5, 0.5), 0.5, 5.5),
        (Shape("box", (2.0, 4.0, 4.0), center=(0, 5, 0)), (0, 5, 0), (1, 2, 2), 3, 8),
        (Shape("capsule", (2.0, 0.5, 0.5)), (0, 0, 0), (0.5, 1.5, 0.5), 1.5, 1.5),
        (Shape("cylinder", (6.0, 4.0, 1.0)), (0, 0, 0), (4, 3, 4), 5, 5),
        (Shape("hull", points=CORNERS), (2, 2, 2), (1, 2, 2), 3, 17**0.5),
        (Shape("plane", center=(0, 2, 0)), (0, 2, 0), (0, 0, 0), 0, 2),
    ],
    ids=lambda value: value.kind if isinstance(value, Shape) else "",
)
def test_boxes_and_spheres(shape: Shape, center: ArrayLike, half_sizes: ArrayLike, radius: float, reach: float) -> None:
    found = shape_extent(shape)
    np.testing.assert_allclose(found.center, np.array(center))
    np.testing.assert_allclose(found.half_sizes, np.array(half_sizes), atol=1e-12)
    assert (found.radius, found.reach) == pytest.approx((radius, reach))


def test_callers_share_what_none_can_change() -> None:
    extents, shape = ShapeExtents(), Shape("hull", points=CORNERS)
    assert extents.of(shape) is extents.of(shape)
    for shared in (extents.of(shape).center, extents.of(shape).half_sizes):
        with pytest.raises(ValueError, match="read-only"):
            shared[0] = 1


@needs_rapier
def test_meshes_end_with_their_scene() -> None:
    points = CORNERS.copy()
    seen = weakref.ref(points)
    run(ground(), body(Shape("hull", points=points), (0, 1, 0)), seconds=0.01)
    del points
    gc.collect()
    assert seen() is None
