"""Obstacles that particles bounce off, and their form for the kernels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError
from anim.maths import quaternion

if TYPE_CHECKING:
    from anim.simulation.particles.kernels.solids import Solids

MAX_OBSTACLES = 60  # bits of an integer
STATIC_M = 1e-9  # a node that moves less, in m or radians, is at rest
Drive: TypeAlias = Callable[[Sequence[int]], tuple[Floats, Floats]]  # nodes → positions, rotations at ends of steps


@dataclass(frozen=True, slots=True)
class Floor:
    """Half-space below y = height m."""

    height: float = 0.0


@dataclass(frozen=True, slots=True)
class Sphere:
    """Ball around `center` (3,) m in the space of `node`, or of the scene for None.

    Scales of nodes don't count. Raises RangeError for a radius that isn't above 0.
    """

    center: tuple[float, float, float]
    radius: float
    node: int | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius > 0):
            raise RangeError(f"the radius of a sphere is {self.radius:g} m (expected above 0)")


@dataclass(frozen=True, slots=True)
class Box:
    """Box of `size` (3,) m around `center` (3,) m along the axes of `node`, or of the scene for None.

    Scales of nodes don't count. Raises RangeError for sizes not above 0.
    """

    center: tuple[float, float, float]
    size: tuple[float, float, float]
    node: int | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.size).all() and min(self.size) > 0):
            raise RangeError(f"the size of a box is {self.size} m (expected three numbers above 0)")


Obstacle: TypeAlias = Floor | Sphere | Box


def pack_obstacles(obstacles: Sequence[Obstacle], drive: Drive | None) -> Solids:
    """Return the obstacles for the kernels. drive: of those on nodes. Raises RangeError for more than 60."""
    from anim.simulation.particles.kernels.solids import BOX, FLOOR, SPHERE, Solids

    if len(obstacles) > MAX_OBSTACLES:
        raise RangeError(f"{len(obstacles)} obstacles (limit {MAX_OBSTACLES})")
    count = len(obstacles)
    kinds, sizes, centers = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3))
    for k, each in enumerate(obstacles):
        match each:
            case Floor(height):
                kinds[k], centers[k, 1] = FLOOR, height
            case Sphere(center, radius):
                kinds[k], centers[k], sizes[k] = SPHERE, center, radius
            case Box(center, size):
                kinds[k], centers[k], sizes[k] = BOX, center, 0.5 * np.asarray(size)
    radii = np.where(kinds == SPHERE, sizes[:, 0], np.linalg.norm(sizes, axis=1))
    poses = np.concatenate([centers, np.tile([0.0, 0, 0, 1], (count, 1))], axis=1)[None]
    nodes = [None if isinstance(each, Floor) else each.node for each in obstacles]
    is_moving = np.array([node is not None for node in nodes], bool)
    if drive is not None and is_moving.any():
        poses = _place(poses, nodes, drive)
        static = np.abs(poses - poses[:1]).max(axis=(0, 2)) < STATIC_M
        is_turned = np.abs(poses[0, :, 3:6]).max(axis=1) > STATIC_M
        is_moving &= ~(static & (~is_turned | (kinds == SPHERE)))
    shapes = np.column_stack([kinds, sizes, radii, is_moving.astype(np.float64)])
    return Solids(shapes, np.ascontiguousarray(poses if is_moving.any() else poses[:1]))


def _place(poses: Floats, nodes: Sequence[int | None], drive: Drive) -> Floats:
    """Poses (S, O, 7) of obstacles whose poses (1, O, 7) are relative to nodes, where they have one."""
    bound = [k for k, node in enumerate(nodes) if node is not None]
    positions, rotations = drive([node for node in nodes if node is not None])
    placed = np.repeat(poses, len(positions), axis=0)
    placed[:, bound, :3] = positions + quaternion.rotate(rotations, placed[:, bound, :3])
    placed[:, bound, 3:] = rotations
    return placed
