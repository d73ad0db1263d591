"""Collisions of tails with colliders, for many joints at once.

Each joint meets its colliders one after another, in their order. Collisions are rare: a block of many pairs of joint
and collider is evaluated at once, and after a collision the later colliders of the joint again.
Source: VRMC_springBone 1.0 and VRMC_springBone_extended_collider 1.0, reference implementations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.simulation.spring_bones.colliders import Collider, ColliderShape

BLOCK_PAIRS = 512  # take as long as one pair, nearly
TINY = 1e-300  # a divisor for vectors without length, so that their direction is 0


@dataclass(frozen=True, slots=True)
class _Pairs:
    """P pairs of a joint (P,) and one of its colliders, by `place` (P,) of this in the joint's order, and then joint.

    row: (P,) of the collider's table. Constants are (P, 1).
    """

    joint: Ints
    place: Ints
    row: Ints
    radius: Floats
    hit_radius: Floats
    side: Floats  # 1 outside, −1 inside
    is_plane: Bools

    def __getitem__(self, kept: slice | Bools) -> _Pairs:
        constants = self.radius[kept], self.hit_radius[kept], self.side[kept], self.is_plane[kept]
        return _Pairs(self.joint[kept], self.place[kept], self.row[kept], *constants)


class Collisions:
    """Colliders of the joints of one batch."""

    def __init__(
        self, colliders: Sequence[Collider], chosen: Sequence[Sequence[int]], hit_radius: Floats, rows: Ints
    ) -> None:
        """Pair joints with their colliders, in blocks.

        chosen: for each joint (m) the indices of its colliders. hit_radius: (m,). rows: (C,) of the colliders' nodes in
        the world matrices.
        """
        used = sorted({index for each in chosen for index in each})
        table = [colliders[index] for index in used]
        self._nodes = rows[used]
        self._points = np.zeros((len(table), 4, 2))  # offset as a point; from it to the tail as a direction
        self._normals = np.zeros((len(table), 3))
        self._points[:, 3, 0] = 1
        self._points[:, :3, 0] = [each.offset for each in table]
        for i, each in enumerate(table):
            if each.shape is ColliderShape.CAPSULE:
                self._points[i, :3, 1] = np.subtract(each.tail, each.offset)
            if each.shape is ColliderShape.PLANE:
                self._normals[i] = each.normal
        self._planes = np.flatnonzero(self._normals.any(axis=1))
        pairs = _pairs(table, used, chosen, hit_radius)
        cuts = range(0, len(pairs.joint), BLOCK_PAIRS)
        self._blocks = [pairs[cut : cut + BLOCK_PAIRS] for cut in cuts]

    def resolve(
        self,
        world: Floats,
        head: Floats,
        length: Floats,
        tail: Floats,
        limit: Callable[[Floats], Floats] | None = None,
    ) -> Floats:
        """Return the tails (m, 3) pushed out of all colliders, at their distance `length` (m, 1) from `head` (m, 3).

        limit: returns the tails within the limits of their directions; called after each collision.
        """
        matrices = world[self._nodes]
        points = np.matmul(matrices, self._points)
        normals = self._world_normals(matrices)
        for pairs in self._blocks:
            while len(pairs.joint):
                planes = normals[pairs.row] if len(normals) else None
                direction, distance = _separation(pairs, tail[pairs.joint], points[pairs.row], planes)
                hits = np.flatnonzero(distance[:, 0] < 0)
                if not len(hits):
                    break
                joint, first = np.unique(pairs.joint[hits], return_index=True)
                hit = hits[first]
                moved = tail[joint] - direction[hit] * distance[hit] - head[joint]
                tail = tail.copy()
                tail[joint] = head[joint] + moved * (length[joint] / np.maximum(norms(moved), TINY))
                tail = tail if limit is None else limit(tail)
                met = np.full(len(tail), np.iinfo(np.int64).max)
                met[joint] = pairs.place[hit]
                pairs = pairs[pairs.place > met[pairs.joint]]
        return np.asarray(tail)

    def _world_normals(self, matrices: Floats) -> Floats:
        """Unit normals (C, 3) of planes in world space, 0 for other shapes; no rows without planes."""
        if not len(self._planes):
            return np.zeros((0, 3))
        normals = np.zeros((len(matrices), 3))
        linear = matrices[self._planes, :, :3]
        carried = np.matmul(cofactors(linear), self._normals[self._planes, :, None])[..., 0]
        mirror = np.sign(np.linalg.det(linear))[:, None]
        normals[self._planes] = mirror * carried / np.maximum(norms(carried), TINY)
        return normals


def _pairs(
    table: Sequence[Collider], used: Sequence[int], chosen: Sequence[Sequence[int]], hit_radius: Floats
) -> _Pairs:
    """All pairs of a joint and a collider of `table`. used: indices of its colliders."""
    counts = np.array([len(each) for each in chosen])
    joint = np.repeat(np.arange(len(chosen)), counts)
    place = np.arange(len(joint)) - np.repeat(np.cumsum(counts) - counts, counts)
    row = np.searchsorted(used, np.concatenate([np.asarray(each, np.int64) for each in chosen]))
    order = np.lexsort((joint, place))
    joint, place, row = joint[order], place[order], row[order]
    radius = np.array([each.radius for each in table])
    side = np.array([-1.0 if each.inside else 1.0 for each in table])
    is_plane = np.array([each.shape is ColliderShape.PLANE for each in table])
    constants = radius[row][:, None], hit_radius[joint][:, None], side[row][:, None], is_plane[row][:, None]
    return _Pairs(joint, place, row, *constants)


def _separation(each: _Pairs, tail: Floats, points: Floats, normals: Floats | None) -> tuple[Floats, Floats]:
    """Unit directions (R, 3) away from the colliders, and distances (R, 1), negative in a collision."""
    delta = tail - points[..., 0]
    along = points[..., 1]
    square = (along * along).sum(axis=-1, keepdims=True)
    fraction = (along * delta).sum(axis=-1, keepdims=True) / np.maximum(square, TINY)
    delta_axis = delta - along * np.clip(fraction, 0, 1)
    length = norms(delta_axis)
    direction = delta_axis * (each.side / np.maximum(length, TINY))
    distance = each.side * (length - each.radius) - each.hit_radius
    if normals is None:
        return direction, distance
    height = (delta * normals).sum(axis=-1, keepdims=True) - each.hit_radius
    return np.where(each.is_plane, normals, direction), np.where(each.is_plane, height, distance)


def norms(vectors: Floats) -> Floats:
    """Return the lengths (..., 1) of vectors (..., 3)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors))[..., None])


def cofactors(matrices: Floats) -> Floats:
    """Return the cofactor matrices (..., 3, 3) of the linear parts of (..., 3, 4): det · inverse transposed."""
    wide = matrices[..., _ROWS, _COLUMNS]
    first, last = slice(1, 4), slice(2, 5)
    return np.asarray(wide[..., first, first] * wide[..., last, last] - wide[..., first, last] * wide[..., last, first])


_COLUMNS = np.array([0, 1, 2, 0, 1])
_ROWS = _COLUMNS[:, None]
