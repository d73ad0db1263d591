"""Depth to which tails are inside colliders, measured on a clip."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.maths import matrix
from anim.model import Clip, Skeleton
from anim.sampling import sample_pose, world_matrices
from anim.simulation.spring_bones.chains import SpringBones, SpringJoint
from anim.simulation.spring_bones.colliders import Collider, ColliderShape
from anim.simulation.spring_bones.collisions import TINY, cofactors, norms

BLOCK_POINTS = 100_000  # positions of tails that are measured at once


def deepest_penetration(skeleton: Skeleton, clip: Clip, bones: SpringBones, times: Floats) -> float:
    """Return the largest depth in metres of a tail in a collider of its chain at `times` (F,), 0 for none.

    Restoring the length after a collision, or the next collider, can move a tail into a collider again.
    """
    world = world_matrices(skeleton, sample_pose(skeleton, clip, times))
    deepest = 0.0
    for chain in bones.chains:
        colliders = [_posed(bones.colliders[index], world) for index in chain.colliders]
        count = max(1, BLOCK_POINTS // max(1, len(times)))
        for first in range(0, len(chain.joints), count):
            joints = chain.joints[first : first + count]
            points = np.stack([_tail(joint, world) for joint in joints])
            radii = np.array([joint.parameters.hit_radius for joint in joints])[:, None]
            for collider, matrices in colliders:
                depth = radii - _distances(collider, matrices, points)
                deepest = max(deepest, float(depth.max(initial=0.0)))
    return deepest


def _tail(joint: SpringJoint, world: Floats) -> Floats:
    """Positions (F, 3) of a joint's tail."""
    if joint.tail is not None:
        return world[:, joint.tail, :, 3]
    return np.asarray(matrix.apply(world[:, joint.node], np.array([joint.tail_offset]))[:, 0])


def _posed(collider: Collider, world: Floats) -> tuple[Collider, Floats]:
    """A collider and its world matrices (F, 3, 4)."""
    scene = np.broadcast_to(np.eye(3, 4), (len(world), 3, 4))
    return collider, scene if collider.node is None else world[:, collider.node]


def _distances(collider: Collider, matrices: Floats, points: Floats) -> Floats:
    """Signed distances (J, F) of points (J, F, 3) from a collider, negative on the side that it keeps free."""
    ends = matrix.apply(matrices, np.array([collider.offset, collider.tail]))
    delta = points - ends[:, 0]
    if collider.shape is ColliderShape.PLANE:
        linear = matrices[..., :3]
        normal = cofactors(linear) @ np.array(collider.normal) * np.sign(np.linalg.det(linear))[:, None]
        return np.asarray((delta * normal).sum(axis=-1) / np.maximum(norms(normal)[:, 0], TINY))
    if collider.shape is ColliderShape.CAPSULE:
        along = ends[:, 1] - ends[:, 0]
        fraction = (along * delta).sum(axis=-1) / np.maximum((along * along).sum(axis=-1), TINY)
        delta = delta - along * np.clip(fraction, 0, 1)[..., None]
    distance = norms(delta)[..., 0] - collider.radius
    return np.asarray(-distance if collider.inside else distance)
