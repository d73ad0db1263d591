"""Obstacles that particles bounce off, and their form for the kernels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError
from anim.maths import quaternion
from anim.simulation.cloth.colliders import Capsule, Plane, place_obstacles
from anim.simulation.limits import MAX_LENGTH_M, check_largest, check_range
from anim.simulation.particles.node_motion import split_frames
from anim.simulation.spring_bones.colliders import Vector

if TYPE_CHECKING:
    from anim.simulation.particles.kernels.solids import Solids

MAX_OBSTACLES = 60  # bits of an integer
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
STATIC_M = 1e-9  # a node that moves less, in m or radians, is at rest
Drive: TypeAlias = Callable[[Sequence[int]], Floats]  # nodes (n,) → world matrices (S, n, 3, 4) at ends of steps
PLANE_BALL_M = 1000.0  # radius around a plane's point, for bounds of its motion


@dataclass(frozen=True, slots=True)
class Floor:
    """Half-space below y = height m. Raises RangeError."""

    height: float = 0.0

    def __post_init__(self) -> None:
        check_largest("floor", (self.height,), MAX_LENGTH_M, "m")


@dataclass(frozen=True, slots=True)
class Sphere:
    """Ball around `center` (3,) m in the space of `node`, or of the scene for None.

    Scales of nodes don't count. Raises RangeError for a radius that isn't above 0.
    """

    center: tuple[float, float, float]
    radius: float
    node: int | None = None

    def __post_init__(self) -> None:
        check_range("radius", self.radius, 0.0, MAX_LENGTH_M, "m", is_above=True)
        check_largest("center", self.center, MAX_LENGTH_M, "m")


@dataclass(frozen=True, slots=True)
class Box:
    """Box of `size` (3,) m around `center` (3,) m along the axes of `node`, or of the scene for None.

    Scales of nodes don't count. Raises RangeError for sizes not above 0.
    """

    center: tuple[float, float, float]
    size: tuple[float, float, float]
    node: int | None = None

    def __post_init__(self) -> None:
        for size in self.size:
            check_range("size", size, 0.0, MAX_LENGTH_M, "m", is_above=True)
        check_largest("center", self.center, MAX_LENGTH_M, "m")


Obstacle: TypeAlias = Floor | Sphere | Box | Capsule | Plane


def pack_obstacles(obstacles: Sequence[Obstacle], drive: Drive | None) -> Solids:
    """Return the obstacles for the kernels. drive: of those on nodes. Raises RangeError for more than 60."""
    from anim.simulation.particles.kernels.solids import CAPSULE, FLOOR, Solids

    if len(obstacles) > MAX_OBSTACLES:
        raise RangeError(f"{len(obstacles)} obstacles (limit {MAX_OBSTACLES})")
    used = sorted({node for each in obstacles for node in _nodes(each)})
    world = drive(used) if drive is not None and used else np.empty((1, 0, 3, 4))
    rows = {node: row for row, node in enumerate(used)}
    shapes, poses = np.zeros((len(obstacles), 6)), np.zeros((len(world), len(obstacles), 7))
    for k, each in enumerate(obstacles):
        shapes[k, :5], poses[:, k] = _placed(each, world, rows)
    static = np.abs(poses - poses[:1]).max(axis=(0, 2), initial=0.0) < STATIC_M
    is_turned = np.abs(poses[0, :, 3:6]).max(axis=1, initial=0.0) > STATIC_M
    is_ball = (shapes[:, 0] == CAPSULE) & (shapes[:, 2] == 0)
    is_limited = shapes[:, 0] != FLOOR
    shapes[:, 5] = ~(static & (~is_turned | (is_ball & is_limited)))
    return Solids(shapes, np.ascontiguousarray(poses if shapes[:, 5].any() else poses[:1]))


def _nodes(obstacle: Obstacle) -> list[int]:
    match obstacle:
        case Floor():
            return []
        case Capsule():
            return [node for node in (obstacle.start_node, obstacle.end_node) if node is not None]
    return [] if obstacle.node is None else [obstacle.node]


def _placed(obstacle: Obstacle, world: Floats, rows: Mapping[int, int]) -> tuple[list[float], Floats]:
    """Kind, three sizes and radius of the ball around an obstacle, and its poses (S, 7).

    world: (S, n, 3, 4) of the nodes. rows: of nodes in it.
    """
    from anim.simulation.particles.kernels.solids import BOX, CAPSULE, FLOOR

    match obstacle:
        case Floor(height):
            return [FLOOR, 0.0, 0.0, 0.0, 0.0], np.array([0.0, height, 0.0, *UPRIGHT])
        case Sphere(center, radius, node):
            return [CAPSULE, radius, 0.0, 1.0, radius], _frames(center, node, world, rows)
        case Box(center, size, node):
            half = 0.5 * np.asarray(size)
            return [BOX, *half.tolist(), float(np.linalg.norm(half))], _frames(center, node, world, rows)
        case Plane(_, _, node):
            own = place_obstacles([replace(obstacle, node=None if node is None else rows[node])], world)[:, 0]
            axes = own[:, 3:6]
            return [FLOOR, 0.0, 0.0, 0.0, PLANE_BALL_M], np.concatenate([own[:, :3], _upright_to(axes)], axis=1)
    ends = [None if node is None else rows[node] for node in (obstacle.start_node, obstacle.end_node)]
    own = place_obstacles([replace(obstacle, start_node=ends[0], end_node=ends[1])], world)[:, 0]
    axes = own[:, 3:6] - own[:, :3]
    length = 0.5 * float(np.linalg.norm(axes, axis=1).max())
    side = -1.0 if obstacle.inside else 1.0
    middle = 0.5 * (own[:, 3:6] + own[:, :3])
    return [CAPSULE, obstacle.radius, length, side, obstacle.radius + length], np.concatenate(
        [middle, _upright_to(axes)], axis=1
    )


def _frames(center: Vector, node: int | None, world: Floats, rows: Mapping[int, int]) -> Floats:
    """Poses (S, 7), or (7,), of a node without its scale, from `center` in its space."""
    if node is None or node not in rows or not world.shape[1]:
        return np.array([*center, *UPRIGHT])
    positions, rotations = split_frames(world[:, [rows[node]]])
    return np.concatenate([positions + quaternion.rotate(rotations, np.asarray(center)), rotations], axis=-1)[:, 0]


def _upright_to(axes: Floats) -> Floats:
    """Rotations (S, 4) that take y to axes (S, 3), each by the shortest one from that before: none about the axis."""
    unit = axes / np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-300)
    unit[~unit.any(axis=1)] = (0.0, 1.0, 0.0)
    result = np.empty((len(unit), 4))
    before, rotation = np.array([0.0, 1.0, 0.0]), np.array(UPRIGHT)
    for i, axis in enumerate(unit):
        if i and (axis == before).all():
            result[i] = rotation
            continue
        rotation = quaternion.normalize(quaternion.multiply(_shortest(before, axis), rotation))
        result[i], before = rotation, axis
    return quaternion.align_signs(result[:, None])[:, 0]


def _shortest(start: Floats, end: Floats) -> Floats:
    cosine = float(start @ end)
    if cosine < -1 + 1e-12:
        across = np.cross(start, (1.0, 0.0, 0.0) if abs(start[0]) < 0.9 else (0.0, 0.0, 1.0))
        return np.array([*(across / np.linalg.norm(across)), 0.0])
    return np.asarray(quaternion.normalize(np.array([*np.cross(start, end), 1 + cosine])))
