"""Pose → local and world matrices of all nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from anim.arrays import Floats
from anim.maths import hierarchy, matrix, quaternion
from anim.model import Pose, Skeleton


def world_matrices(skeleton: Skeleton, pose: Pose) -> Floats:
    """Return world_from_node (F, N, 3, 4) for every time and node of a pose."""
    return world_by_node(skeleton, pose).transpose(1, 0, 2, 3)


def world_by_node(skeleton: Skeleton, pose: Pose) -> Floats:
    """Return world_from_node (N, F, 3, 4), in the memory order of the computation."""
    return accumulate(skeleton, local_by_node(skeleton, pose))


def accumulate(skeleton: Skeleton, local: Floats) -> Floats:
    """Return world_from_node (N, F, 3, 4) in place of parent_from_node (N, F, 3, 4)."""
    return matrix.accumulate_world(local, skeleton.parents, skeleton.levels(), in_place=True)


def world_rotations(skeleton: Skeleton, local: Floats) -> Floats:
    """Return the world rotations (N, F, 4) of all nodes from local ones (F, N, 4).

    Scales count by the signs of the rest pose only. Below an odd count of negative scales the result is the rotation
    in −1 times the orthogonal world matrix: the −1 cancels between two poses.
    """
    own = np.swapaxes(local, 0, 1).copy()
    below = np.flatnonzero(skeleton.parents >= 0)
    signs = _scale_signs(skeleton.scale[skeleton.parents[below]])
    some = (signs < 0).any(axis=-1)
    own[below[some]] = quaternion.multiply(_half_turns(signs[some])[:, None], own[below[some]])
    return hierarchy.accumulate(own, skeleton.parents, skeleton.levels(), quaternion.multiply, out=own)


def with_scale_signs(skeleton: Skeleton, node: int, world: Mapping[int, Floats]) -> Floats:
    """Return a node's world rotation (..., 4) times the signs of its scale: the space of its children."""
    signs = _scale_signs(skeleton.scale[node])
    if (signs > 0).all():
        return world[node]
    return quaternion.multiply(world[node], _half_turns(signs))


def _scale_signs(scale: Floats) -> Floats:
    """The signs (..., 3) of scales (..., 3) times their product: none or two are negative, as of a rotation."""
    signs = np.where(scale < 0, -1.0, 1.0)
    return np.asarray(signs * signs.prod(axis=-1, keepdims=True))


def _half_turns(signs: Floats) -> Floats:
    """The rotations (..., 4) by 180° about the axis that is not negated, of signs (..., 3) with two negative ones."""
    return np.concatenate((signs > 0, np.zeros((*signs.shape[:-1], 1))), axis=-1)


def local_by_node(skeleton: Skeleton, pose: Pose) -> Floats:
    """Return parent_from_node (N, F, 3, 4) for every node and time of a pose."""
    return local_matrices(skeleton, [np.swapaxes(part, 0, 1) for part in (pose.translation, pose.rotation, pose.scale)])


def local_matrices(skeleton: Skeleton, parts: Sequence[Floats]) -> Floats:
    """Return parent_from_node (N, F, 3, 4) of all nodes from translation, rotation and scale (N, F, ·)."""
    local = matrix.from_trs(*parts)
    if len(skeleton.sheared):
        local[skeleton.sheared] = skeleton.sheared_local[:, None]
    return local
