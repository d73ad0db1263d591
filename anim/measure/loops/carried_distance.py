"""Distances that vertices move where single nodes change: in blocks of nodes, so that memory is bounded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise, starmap
from typing import NamedTuple, TypeAlias

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hierarchy
from anim.measure.error.point_matrix import PointMatrix
from anim.measure.loops.rigid_distance import rigid_distances
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Pose, Skeleton
from anim.sampling.world import world_by_node

PARTS = ("translation", "rotation", "scale")
MAX_MATRICES = 250_000  # nodes × changed nodes per block, each about 500 bytes
MAX_BLOCK = 64  # changed nodes of a large skeleton: with more, most matrices are of nodes that don't move

Differences: TypeAlias = Callable[[Ints], Floats]  # of matrices (J, F, 3, 4) of nodes (J,)


def carried_distances(skin: SkinMotion, ends: Sequence[Pose], clip: Ints, nodes: Ints, roots: Ints) -> Floats:
    """Return the largest distances (K,) that a point moves if one node of one clip, alone, ends as it starts.

    ends: the poses at the start and at the end of R clips, R frames each. clip: (K,) indices of these, in order.
    nodes: (K,). roots: (R,) of each clip the node whose translation stays that of the end, −1 for none.
    """
    if not len(skin.vertices) or not len(nodes):
        return np.zeros(len(nodes))
    size = max(MAX_MATRICES // len(skin.skeleton), 1)
    is_whole = int(np.bincount(clip).max()) <= size
    if not is_whole and (found := _rigid_distances(skin, ends, clip, nodes, roots)) is not None:
        return found
    starts = range(0, len(nodes), size) if is_whole else _block_starts(skin.skeleton, nodes)
    squares = []
    for block in starmap(slice, pairwise([*starts, len(nodes)])):
        changed = _Changed(clip[block], nodes[block], roots[clip[block]])
        if is_whole:
            squares.append(_squares(skin.skeleton, ends, changed, skin.squares, skin.batch_size(1)))
        else:
            squares.append(_squares_of_part(skin, ends, changed))
    return np.asarray(np.sqrt(np.concatenate(squares)))


def _rigid_distances(skin: SkinMotion, ends: Sequence[Pose], clip: Ints, nodes: Ints, roots: Ints) -> Floats | None:
    """The distances of many nodes whose points have one joint each; None for others. Arguments as there."""
    parts = []
    for i in np.unique(clip).tolist():
        some = [_take_frames(each, slice(i, i + 1)) for each in ends]
        found = rigid_distances(skin.skeleton, skin.vertices, some, nodes[clip == i], int(roots[i]))
        if found is None:
            return None
        parts.append(found)
    return np.concatenate(parts)


def _block_starts(skeleton: Skeleton, nodes: Ints) -> list[int]:
    """Starts of blocks of nodes (K,) of which each has few nodes below and above, or is one node."""
    first, end = skeleton.subtrees()
    related = (end - first + hierarchy.find_depths(skeleton.parents))[nodes].tolist()
    starts, total = [0], 0
    for i, count in enumerate(related):
        total += count
        length = i + 1 - starts[-1]
        if length > 1 and (length > MAX_BLOCK or min(total, len(skeleton)) * length > MAX_MATRICES):
            starts.append(i)
            total = count
    return starts


class _Changed(NamedTuple):
    """Single nodes that change: clip (K,), in order, node (K,), and the clip's root (K,) or −1."""

    clip: Ints
    node: Ints
    root: Ints


def _squares(
    skeleton: Skeleton,
    ends: Sequence[Pose],
    changed: _Changed,
    squares: Callable[[Differences], Floats],
    count: int,
) -> Floats:
    """Largest squared distances (K,).

    squares: gives those of all points (P, F) from differences of matrices, for `count` frames at once.
    """
    low, high = int(changed.clip[0]), int(changed.clip[-1]) + 1
    start, end = (_take_frames(each, slice(low, high)) for each in ends)
    clip = changed.clip - low
    row = np.arange(len(clip))
    new = _take_frames(end, clip)
    for name in PARTS:
        returns = row[changed.node != changed.root] if name == "translation" else row
        node = changed.node[returns]
        getattr(new, name)[returns, node] = getattr(start, name)[clip[returns], node]
    differences = world_by_node(skeleton, new)
    differences -= world_by_node(skeleton, end)[:, clip]
    stretches = (differences[:, first : first + count] for first in range(0, len(clip), count))
    return np.concatenate([squares(each.__getitem__).max(axis=0, initial=0.0) for each in stretches])


def _take_frames(pose: Pose, frames: Ints | slice) -> Pose:
    return Pose(pose.times[frames], pose.translation[frames], pose.rotation[frames], pose.scale[frames])


def _squares_of_part(skin: SkinMotion, ends: Sequence[Pose], changed: _Changed) -> Floats:
    """The same for a few nodes of many: only what is below them moves."""
    below, kept = _subtrees(skin.skeleton, changed.node)
    index = np.cumsum(kept) - 1
    points = _points_below(skin.vertices, below, index)
    if not len(points):
        return np.zeros(len(changed.node))
    part = [Pose(each.times, *(getattr(each, name)[:, kept] for name in PARTS)) for each in ends]
    own = _Changed(changed.clip, index[changed.node], np.where(changed.root == changed.node, index[changed.node], -1))
    return _squares(_take(skin.skeleton, kept, index), part, own, points.squares, len(changed.node))


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
