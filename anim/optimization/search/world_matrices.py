"""World matrices of a clip's nodes at many times, of those nodes only that something hangs on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.model import Skeleton


def required_levels(skeleton: Skeleton, nodes: Ints) -> tuple[Ints, ...]:
    """Return the nodes of each depth, roots first, leaving out those that none of `nodes` hangs on."""
    needed = np.zeros(len(skeleton), np.bool_)
    for node in nodes.tolist():
        while node >= 0 and not needed[node]:
            needed[node] = True
            node = int(skeleton.parents[node])
    return tuple(level[needed[level]] for level in skeleton.levels())


def level_world_matrices(skeleton: Skeleton, local: Sequence[Floats], levels: Sequence[Ints]) -> Floats:
    """Return world matrices (N, F, 3, 4) from translation, rotation and scale (N, F, ·); rotations as they are, unit or
    not. Nodes outside `levels` hold no meaning."""
    return matrix.accumulate_world(local_matrices(skeleton, local), skeleton.parents, list(levels))


def local_matrices(skeleton: Skeleton, local: Sequence[Floats]) -> Floats:
    """Return local matrices (N, F, 3, 4) of all nodes from translation, rotation and scale (N, F, ·)."""
    translation, rotation, scale = local
    matrices = matrix.from_trs(translation, rotation, scale)
    if len(skeleton.sheared):
        matrices[skeleton.sheared] = skeleton.sheared_local[:, None]
    return matrices
