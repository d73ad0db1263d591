"""Distances that points with one joint each move where single nodes change: all below a node as one rigid body.

The points below a node are one range in depth-first order, so that a tree of many nodes takes no product per pair.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.measure.error.point_matrix import CORNERS, PointMatrix
from anim.model import Pose, Skeleton
from anim.sampling.world import world_by_node

BLOCK = 1024  # points with one box
MAX_BLOCKS = 128  # that are looked at together
MIN_DETERMINANT = 1e-12  # of a world matrix, next to the cube of its largest element


def rigid_distances(
    skeleton: Skeleton, points: PointMatrix, ends: Sequence[Pose], nodes: Ints, root: int
) -> Floats | None:
    """Return the largest distances (K,) that a point moves if one node alone ends as it starts.

    None if points have several joints, or matrices are singular: then points don't move as one body. ends: the poses at
    the start and at the end, one frame each. root: the node whose translation stays that of the end, −1 for none.
    """
    if points.joints.shape[1] != 1:
        return None
    world = world_by_node(skeleton, ends[1])[:, 0]
    if not _are_regular(world[nodes]):
        return None
    first, end = skeleton.subtrees()
    joints = points.nodes[points.joints[:, 0]]
    order = np.argsort(first[joints], kind="stable")
    joints = joints[order]
    places = np.einsum("pij,pj->pi", world[joints], points.factors[order, 0])
    spans = (np.searchsorted(first[joints], each[nodes]).tolist() for each in (first, end))
    moves = matrix.multiply(_changed_worlds(skeleton, ends, world, nodes, root), matrix.inverse(world[nodes]))
    moves[..., :3] -= np.eye(3)
    ranges = _PointRanges(places)
    return np.array([ranges.farthest(*each) for each in zip(moves, *spans, strict=True)])


def _are_regular(world: Floats) -> bool:
    linear = world[..., :3]
    sizes = np.abs(linear).max(axis=(-1, -2), initial=0.0)
    return bool((np.abs(np.linalg.det(linear)) > MIN_DETERMINANT * sizes**3).all())


def _changed_worlds(skeleton: Skeleton, ends: Sequence[Pose], world: Floats, nodes: Ints, root: int) -> Floats:
    """World matrices (K, 3, 4) of the nodes, each with its own transform at the start below its parent at the end."""
    start, last = ends
    translation = np.where((nodes == root)[:, None], last.translation[0, nodes], start.translation[0, nodes])
    local = matrix.from_trs(translation, start.rotation[0, nodes], start.scale[0, nodes])
    above = skeleton.parents[nodes]
    parents = np.where((above >= 0)[:, None, None], world[above], np.eye(4)[:3])
    return np.asarray(matrix.multiply(parents, local))


class _PointRanges:
    """Points (P, 3), of whose ranges the farthest one is asked for, with the box of each block of them."""

    def __init__(self, places: Floats) -> None:
        self._places = places
        self._blocks = places[: len(places) // BLOCK * BLOCK].reshape(-1, BLOCK, 3)
        low, high = self._blocks.min(axis=1), self._blocks.max(axis=1)
        self._corners = np.where(CORNERS > 0, high[:, None], low[:, None])  # (B, 8, 3)

    def farthest(self, move: Floats, low: int, high: int) -> float:
        """Return the length of the longest of M p + t of points low … high, of a matrix (3, 4); 0 without points.

        That is largest at a corner of a box: of most blocks no point is looked at.
        """
        first, last = -(-low // BLOCK), high // BLOCK
        if last <= first:
            return self._largest(move, low, high)
        bounds = _lengths(move, self._corners[first:last].reshape(-1, 3)).reshape(-1, 8).max(axis=1)
        best = first + int(bounds.argmax())
        spans = (low, first * BLOCK), (best * BLOCK, (best + 1) * BLOCK), (last * BLOCK, high)
        most = max(self._largest(move, *span) for span in spans)
        others = first + np.flatnonzero(bounds > most)
        for some in np.array_split(others, len(others) // MAX_BLOCKS + 1):
            most = max(most, float(_lengths(move, self._blocks[some].reshape(-1, 3)).max(initial=0.0)))
        return most

    def _largest(self, move: Floats, low: int, high: int) -> float:
        return float(_lengths(move, self._places[low:high]).max(initial=0.0))


def _lengths(move: Floats, points: Floats) -> Floats:
    moved = points @ move[:, :3].T + move[:, 3]
    return np.asarray(np.sqrt(np.einsum("pi,pi->p", moved, moved)))
