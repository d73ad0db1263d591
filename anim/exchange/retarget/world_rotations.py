"""World rotations of a hierarchy, without scale."""

from __future__ import annotations

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Skeleton


def world_rotations(skeleton: Skeleton, local: Floats) -> dict[int, Floats]:
    """Return the world rotation (F, 4) of every node from local ones (F, N, 4)."""
    world: dict[int, Floats] = {}
    for level in skeleton.levels():
        for node in level.tolist():
            parent = int(skeleton.parents[node])
            own = local[:, node]
            world[node] = own if parent < 0 else quaternion.multiply(world[parent], own)
    return world
