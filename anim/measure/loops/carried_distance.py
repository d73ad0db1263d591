"""Distances that vertices move where single nodes change: in blocks of nodes, so that memory is bounded."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hierarchy
from anim.measure.error.point_matrix import PointMatrix, stack_blocks
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Pose, Skeleton
from anim.sampling.world import world_by_node

PARTS = ("translation", "rotation", "scale")
MAX_MATRICES = 250_000  # nodes × changed nodes per block, each about 500 bytes

Differences: TypeAlias = Callable[[Ints], Floats]  # of matrices (J, F, 3, 4) of nodes (J,)


def carried_distances(skin: SkinMotion, both: Pose, nodes: Ints, root: int) -> Floats:
    """Return the largest distance (K,) that a point moves if one of the nodes (K,), alone, ends as it starts.

    both: start and end as a pose of two frames. root: its translation stays that of the end, −1 for none.
    """
    if not len(skin.vertices):
        return np.zeros(len(nodes))
    size = MAX_MATRICES // max(len(skin.skeleton), 1)
    if len(nodes) <= size:
        squares = _squares(skin.skeleton, both, nodes, root, skin.squares, skin.batch_size(1))
    else:
        blocks = (nodes[first : first + max(size, 1)] for first in range(0, len(nodes), max(size, 1)))
        squares = np.concatenate([_squares_of_part(skin, both, block, root) for block in blocks])
    return np.asarray(np.sqrt(squares))


def _squares(
    skeleton: Skeleton, both: Pose, nodes: Ints, root: int, squares: Callable[[Differences], Floats], count: int
) -> Floats:
    """Largest squared distances (K,).

    squares: gives those of all points (P, F) from differences of matrices, for `count` frames at once.
    """
    frame = np.arange(len(nodes))
    parts = {name: np.repeat(getattr(both, name)[1:], len(nodes), axis=0) for name in PARTS}
    for name, values in parts.items():
        values[frame, nodes] = getattr(both, name)[0, nodes]
    if root >= 0:
        parts["translation"][:, root] = both.translation[1, root]
    last = Pose(both.times[1:], both.translation[1:], both.rotation[1:], both.scale[1:])
    times = np.repeat(both.times[1:], len(nodes))
    changed = Pose(times, parts["translation"], parts["rotation"], parts["scale"])
    differences = np.subtract(*(world_by_node(skeleton, each) for each in (changed, last)))
    stretches = (differences[:, first : first + count] for first in range(0, len(nodes), count))
    found = [squares(each.__getitem__).max(axis=0, initial=0.0) for each in stretches]
    return np.concatenate(found) if found else np.zeros(0)


def _squares_of_part(skin: SkinMotion, both: Pose, nodes: Ints, root: int) -> Floats:
    """The same for a few nodes of many: only what is below them moves."""
    below, kept = _subtrees(skin.skeleton, nodes)
    index = np.cumsum(kept) - 1
    points = _points_below(skin.vertices, below, index)
    if not len(points):
        return np.zeros(len(nodes))
    rows = points.rows()

    def squares(differences: Differences) -> Floats:
        return rows.squares(stack_blocks(differences, points.nodes))

    part = Pose(both.times, both.translation[:, kept], both.rotation[:, kept], both.scale[:, kept])
    own_root = int(index[root]) if root >= 0 and kept[root] else -1
    return _squares(_take(skin.skeleton, kept, index), part, index[nodes], own_root, squares, len(nodes))


def _subtrees(skeleton: Skeleton, nodes: Ints) -> tuple[Bools, Bools]:
    """Masks (N,) of the nodes and their descendants, and of these and their ancestors."""
    chosen = np.zeros(len(skeleton), np.bool_)
    chosen[nodes] = True
    below = hierarchy.with_descendants(skeleton.parents, chosen)
    return below, hierarchy.with_ancestors(skeleton.parents, below)


def _take(skeleton: Skeleton, kept: Bools, index: Ints) -> Skeleton:
    """Some nodes of a skeleton, with all of their ancestors."""
    parents = skeleton.parents[kept]
    sheared = kept[skeleton.sheared]
    return Skeleton(
        ("",) * len(parents),
        np.where(parents < 0, -1, index[parents]),
        skeleton.translation[kept],
        skeleton.rotation[kept],
        skeleton.scale[kept],
        index[skeleton.sheared[sheared]],
        skeleton.sheared_local[sheared],
    )


def _points_below(points: PointMatrix, below: Bools, index: Ints) -> PointMatrix:
    """The points on nodes of a mask (N,), without their other joints. index: (N,) new indices of nodes."""
    nodes = points.nodes[points.joints]
    chosen = np.flatnonzero(below[nodes].any(axis=1))
    is_below = below[nodes[chosen]]
    joints = np.where(is_below, (np.cumsum(below) - 1)[nodes[chosen]], 0)
    return PointMatrix(index[np.flatnonzero(below)], joints, points.factors[chosen] * is_below[..., None])
