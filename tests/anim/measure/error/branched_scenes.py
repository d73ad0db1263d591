"""Hierarchies of many nodes by chance, and meshes for them."""

from __future__ import annotations

import numpy as np

from anim.maths import quaternion
from anim.model import Mesh, Skeleton

SHEARED = 20  # index of the node with a `matrix` that is sheared


def branches(random: np.random.Generator, count: int) -> Skeleton:
    """Branches of long bones, scaled, one of the nodes by a shear; the last three nodes are two more roots."""
    parents = np.array([-1, *(int(random.integers(max(i - 4, 0), i)) for i in range(1, count - 3)), -1, count - 3, -1])
    shear = np.eye(4)[None, :3] + 0.2 * random.normal(size=(1, 3, 4))
    return Skeleton(
        tuple(f"n{i}" for i in range(count)),
        parents,
        0.3 * random.normal(size=(count, 3)),
        quaternion.normalize(random.normal(size=(count, 4))),
        random.uniform(0.8, 1.2, (count, 3)),
        np.array([SHEARED]),
        shear,
    )


def mesh(random: np.random.Generator, name: str, joints: int, targets: int = 0) -> Mesh:
    """Five vertices with two influences each; without joints a rigid mesh."""
    weights = random.uniform(size=(5, 2)) + 0.1
    return Mesh(
        name,
        random.normal(size=(5, 3)),
        np.array([[0, 1, 2], [2, 3, 4]]),
        random.integers(0, joints, (5, 2)) if joints else np.empty((5, 0), np.int64),
        weights / weights.sum(axis=1, keepdims=True) if joints else np.empty((5, 0)),
        0.2 * random.normal(size=(targets, 5, 3)),
        np.zeros(targets),
    )
