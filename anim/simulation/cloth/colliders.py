"""Colliders of cloth: spheres, capsules and planes on nodes or in the scene."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import DataRangeError, RangeError
from anim.simulation.limits import MAX_LENGTH_M, check_largest, check_range
from anim.simulation.spring_bones.colliders import Collider, ColliderShape, Vector
from anim.simulation.spring_bones.collisions import cofactors

OUTSIDE, INSIDE, PLANE = 1.0, -1.0, 0.0  # as in kernels/collisions.py, which isn't imported without need


@dataclass(frozen=True, slots=True)
class Capsule:
    """Collider between two points, each (3,) m in the space of a node, or of the scene for None; a ball if equal.

    inside: points stay inside of it. Raises RangeError for a radius that isn't above 0, or above MAX_LENGTH_M.
    """

    start: Vector
    end: Vector
    radius: float
    start_node: int | None = None
    end_node: int | None = None
    inside: bool = False

    def __post_init__(self) -> None:
        check_range("radius", self.radius, 0.0, MAX_LENGTH_M, "m", is_above=True)
        for point in (self.start, self.end):
            check_largest("center", point, MAX_LENGTH_M, "m")


@dataclass(frozen=True, slots=True)
class Plane:
    """Collider below a plane: a point (3,) m of it, and its normal, in the space of a node, or of the scene for None.

    Raises RangeError for a normal without length.
    """

    point: Vector
    normal: Vector
    node: int | None = None

    def __post_init__(self) -> None:
        check_largest("point", self.point, MAX_LENGTH_M, "m")
        length = float(np.linalg.norm(self.normal))
        if not (np.isfinite(length) and length > 0):
            raise RangeError(f"the normal of a plane is {self.normal} (expected a direction)")


Obstacle = Capsule | Plane


def from_spring_colliders(colliders: Iterable[Collider]) -> tuple[Obstacle, ...]:
    """Return the colliders of spring bones for cloth; those without a size are left out.

    Raises DataRangeError for a size or position beyond the limits.
    """
    try:
        return tuple(_obstacle(each) for each in colliders if each.radius > 0 or each.shape is ColliderShape.PLANE)
    except RangeError as error:
        raise DataRangeError(error.problem, where="a collider of spring bones") from None


def _obstacle(collider: Collider) -> Obstacle:
    if collider.shape is ColliderShape.PLANE:
        return Plane(collider.offset, collider.normal, collider.node)
    end = collider.tail if collider.shape is ColliderShape.CAPSULE else collider.offset
    return Capsule(collider.offset, end, collider.radius, collider.node, collider.node, collider.inside)


def place_obstacles(obstacles: Sequence[Obstacle], world: Floats) -> Floats:
    """Return the rows (S, C, 8) of `push_out` for the nodes' world matrices (S, N, 3, 4)."""
    rows = np.zeros((len(world), len(obstacles), 8))
    for k, each in enumerate(obstacles):
        if isinstance(each, Plane):
            rows[:, k, :3] = _points(each.point, each.node, world)
            rows[:, k, 3:6] = _normals(each.normal, each.node, world)
            rows[:, k, 7] = PLANE
        else:
            rows[:, k, :3] = _points(each.start, each.start_node, world)
            rows[:, k, 3:6] = _points(each.end, each.end_node, world)
            rows[:, k, 6] = each.radius
            rows[:, k, 7] = INSIDE if each.inside else OUTSIDE
    return rows


def _points(point: Vector, node: int | None, world: Floats) -> Floats:
    at = np.asarray(point)
    return at if node is None else np.asarray(world[:, node, :, :3] @ at + world[:, node, :, 3])


def _normals(normal: Vector, node: int | None, world: Floats) -> Floats:
    """Unit normals (S, 3) or (3,), by the inverse transposed matrices; up where a node has no size."""
    n = np.asarray(normal, np.float64)
    if node is not None:
        linear = world[:, node, :, :3]
        n = cofactors(linear) @ n * np.sign(np.linalg.det(linear))[:, None]
    length = np.linalg.norm(n, axis=-1, keepdims=True)
    return np.where(length > 0, n / np.where(length > 0, length, 1), (0.0, 1.0, 0.0))
