"""Limits of the directions of spring bones: cones, hinges and spherical ones, for many joints at once.

Source: VRMC_springBone_limit 1.0-draft, reference implementation. Directions are those in the limit's own space, whose
y axis is the bone at rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from anim.arrays import Bools, Floats
from anim.errors import RangeError
from anim.maths import quaternion
from anim.simulation.spring_bones.colliders import check_numbers, check_quantity
from anim.simulation.spring_bones.collisions import TINY, cofactors, norms

SINGULAR = 1e-12  # length of a direction's part across an axis, below which it is along the axis
IDENTITY = (0.0, 0.0, 0.0, 1.0)


class LimitShape(StrEnum):
    """Shape of a limit, by the names of VRMC_springBone_limit."""

    CONE = "cone"
    HINGE = "hinge"
    SPHERICAL = "spherical"


@dataclass(frozen=True, slots=True)
class AngleLimit:
    """Limit of a joint's direction.

    angle: rad, of a cone or hinge, or the pitch of a spherical limit; more than π is π. yaw: rad, of a spherical limit;
    more than π/2 is π/2. rotation: unit quaternion xyzw of the limit from the bone at rest.
    Raises RangeError for negative angles, numbers that are not finite, and a rotation without length.
    """

    shape: LimitShape
    angle: float
    yaw: float = 0.0
    rotation: tuple[float, float, float, float] = IDENTITY

    def __post_init__(self) -> None:
        check_quantity(self.angle, "pitch" if self.shape is LimitShape.SPHERICAL else "angle", least=0.0)
        check_quantity(self.yaw, "yaw", least=0.0)
        for name in ("angle", "yaw"):
            object.__setattr__(self, name, float(getattr(self, name)))  # numpy has no type for the integers of JSON
        x, y, z, w = check_numbers(self.rotation, "rotation", 4)
        if not np.linalg.norm((x, y, z, w)):
            raise RangeError(f"rotation is {self.rotation} (expected a unit quaternion)")
        object.__setattr__(self, "rotation", (x, y, z, w))


class AngleLimits:
    """Limits of the joints of one batch."""

    def __init__(self, limits: Sequence[AngleLimit | None], axes: Floats) -> None:
        """limits: of each joint (m), None for none. axes: (m, 3), unit vectors to the tails in the joints' space."""
        self._joints = np.array([i for i, each in enumerate(limits) if each is not None], np.int64)
        found = [each for each in limits if each is not None]
        rotations = quaternion.normalize(np.array([each.rotation for each in found]))
        self._frames = quaternion.to_matrix(quaternion.multiply(_upright_to(axes[self._joints]), rotations))
        self._pitch = np.minimum(np.array([each.angle for each in found]), math.pi)
        self._yaw = np.minimum(np.array([each.yaw for each in found]), math.pi / 2)
        self._shapes = [(shape, np.array([each.shape is shape for each in found])) for shape in LimitShape]

    def resolve(self, linear: Floats, head: Floats, length: Floats, tail: Floats) -> Floats:
        """Return the tails (m, 3) within their limits, at their distance `length` (m, 1) from `head` (m, 3).

        linear: (m, 3, 3) of the joints' world matrices at rest.
        """
        own = linear[self._joints]
        offset = tail[self._joints] - head[self._joints]
        cofactor = cofactors(own)
        mirror = np.where((own[:, 0] * cofactor[:, 0]).sum(axis=-1) < 0, -1.0, 1.0)[:, None]
        local = mirror * np.matmul(offset[:, None, :], cofactor)[:, 0]
        direction = np.matmul(local[:, None, :], self._frames)[:, 0]
        direction = direction / np.maximum(norms(direction), TINY)
        limited, is_changed = direction.copy(), np.zeros(len(direction), bool)
        for shape, rows in self._shapes:
            if rows.any():
                limited[rows], is_changed[rows] = LIMITS[shape](direction[rows], self._pitch[rows], self._yaw[rows])
        if not is_changed.any():
            return tail
        world = np.matmul(own, np.matmul(self._frames, limited[..., None]))[..., 0]
        world = world * (length[self._joints] / np.maximum(norms(world), TINY))
        result = tail.copy()
        result[self._joints[is_changed]] = (head[self._joints] + world)[is_changed]
        return result


def _limit_cone(direction: Floats, angle: Floats, yaw: Floats) -> tuple[Floats, Bools]:
    """Directions (n, 3) within a cone about y, and whether they were outside (n,); from −y the boundary towards +z."""
    around = _unit_or(direction[:, [0, 2]], (0.0, 1.0))
    x, z = (np.sin(angle)[:, None] * around).T
    is_outside = direction[:, 1] < np.cos(angle)
    return np.where(is_outside[:, None], np.stack([x, np.cos(angle), z], axis=1), direction), is_outside


def _limit_hinge(direction: Floats, angle: Floats, yaw: Floats) -> tuple[Floats, Bools]:
    """Directions (n, 3) in the plane yz, within an angle of y; from ±x to y, from −y the boundary towards +z."""
    y, z = _unit_or(direction[:, 1:], (1.0, 0.0)).T
    is_outside = y < np.cos(angle)
    y, z = np.where(is_outside, (np.cos(angle), np.where(z < 0, -1, 1) * np.sin(angle)), (y, z))
    return np.stack([np.zeros_like(y), y, z], axis=1), is_outside | (direction[:, 0] != 0)


def _limit_sphere(direction: Floats, most_pitch: Floats, most_yaw: Floats) -> tuple[Floats, Bools]:
    """Directions (n, 3) within a pitch about x and a yaw about z; from −y the boundary towards +z."""
    x, y, z = direction.T
    pitch = np.where(np.hypot(y, z) < SINGULAR, 0.0, np.arctan2(z, y))
    pitch = np.where(np.hypot(x, z) < SINGULAR, np.where(y < 0, math.pi, 0.0), pitch)
    yaw = np.arcsin(np.clip(x, -1, 1))
    is_outside = (np.abs(pitch) > most_pitch) | (np.abs(yaw) > most_yaw)
    pitch, yaw = np.clip(pitch, -most_pitch, most_pitch), np.clip(yaw, -most_yaw, most_yaw)
    limited = np.stack([np.sin(yaw), np.cos(yaw) * np.cos(pitch), np.cos(yaw) * np.sin(pitch)], axis=1)
    return np.where(is_outside[:, None], limited, direction), is_outside


LIMITS: Mapping[LimitShape, Callable[[Floats, Floats, Floats], tuple[Floats, Bools]]] = {
    LimitShape.CONE: _limit_cone,
    LimitShape.HINGE: _limit_hinge,
    LimitShape.SPHERICAL: _limit_sphere,
}


def _unit_or(vectors: Floats, instead: tuple[float, float]) -> Floats:
    """Unit vectors (n, 2), `instead` for those without length."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length < SINGULAR, np.array(instead), vectors / np.maximum(length, TINY))


def _upright_to(axes: Floats) -> Floats:
    """Shortest rotations (n, 4) from y to unit axes (n, 3); a half turn about x to −y."""
    x, y, z = axes.T
    found = np.stack([z, 0 * x, -x, 1 + y], axis=1)
    found[1 + y < SINGULAR] = (1.0, 0.0, 0.0, 0.0)
    return quaternion.normalize(found)
