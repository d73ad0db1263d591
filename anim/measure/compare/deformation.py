"""Equality of two meshes: primitives, and for the same vertices joints, weights and morph targets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.model import Mesh, MeshInstance

WEIGHT_TOLERANCE = 0.02  # four weights stored as bytes, their rounding added to one of them: 4 · 1 / 255
TARGET_TOLERANCE_PER_SIZE = 1e-3  # of the mesh's size: displacements stored in 10 bits
TARGET_TOLERANCE_PER_ROUNDING = 2.0  # of the largest distance of vertices: a target is the difference of two of them


def same_influences(old: Mesh, old_joints: Ints, new: Mesh, new_joints: Ints) -> bool:
    """Return whether every vertex has the same weight on every node, up to the rounding of stored weights.

    old_joints, new_joints: (J,) nodes of the second scene that stand for the joints of each mesh.
    """
    nodes = [old_joints[old.joints], new_joints[new.joints]]
    if np.array_equal(nodes[0], nodes[1]) and np.array_equal(old.weights, new.weights):
        return True
    num_nodes = max(int(each.max(initial=0)) for each in nodes) + 2  # −1, the world, is one too
    vertices = np.arange(len(old.positions))[:, None]
    keys = np.concatenate([(vertices * num_nodes + each + 1).ravel() for each in nodes])
    _, pairs = np.unique(keys, return_inverse=True)
    differences = np.bincount(pairs.ravel(), np.concatenate((old.weights.ravel(), -new.weights.ravel())))
    return bool(np.abs(differences).max(initial=0.0) <= WEIGHT_TOLERANCE)


def same_targets(old: Mesh, new: Mesh, new_from_old: Floats) -> bool:
    """Return whether both have the same morph targets, up to the rounding of stored displacements.

    new_from_old: (3, 4) transform between the two mesh spaces.
    """
    if old.targets.shape != new.targets.shape:
        return False
    if not old.targets.size:
        return True
    moved = old.targets @ new_from_old[:, :3].T
    rounding = float(np.abs(matrix.apply(new_from_old, old.positions) - new.positions).max(initial=0.0))
    size = float(np.linalg.norm(np.ptp(new.positions, axis=0)))
    limit = max(TARGET_TOLERANCE_PER_SIZE * size, TARGET_TOLERANCE_PER_ROUNDING * rounding)
    return bool(np.abs(moved - new.targets).max() <= limit)


def is_reduced(old: Mesh, new: Mesh) -> bool:
    """Return whether the second mesh lost primitives with their vertices and faces; merged ones keep them."""
    if len(new.primitives) >= len(old.primitives) or len(new.positions) >= len(old.positions):
        return False
    return len(old.faces) - len(new.faces) >= min(each.faces for each in old.primitives)


def are_missing(old: Sequence[MeshInstance], some: Sequence[int], new: Sequence[MeshInstance]) -> bool:
    """Return whether the second scene lacks exactly the vertices of some instances: merged meshes keep them."""
    before, after = (sum(len(each.mesh.positions) for each in instances) for instances in (old, new))
    return bool(new) and before - after == sum(len(old[i].mesh.positions) for i in some)
