"""Skeletons of many nodes reduced to those that move: the others follow the nearest of them by a constant matrix."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hierarchy, matrix, quaternion
from anim.model import Clip, Skeleton, parse_weight_pointer
from anim.model.skeleton import nearest_at_or_above
from anim.sampling.pose import rest_pose
from anim.sampling.world import local_by_node

MIN_NODES = 1000  # of a skeleton that is reduced: with fewer the time is that of something else
MAX_MOVING_FRACTION = 0.5  # of the nodes, in a skeleton that is reduced
IDENTITY = np.eye(4)[None, :3]


class ReducedSkeleton(NamedTuple):
    """The nodes that move in two versions of a skeleton of the same hierarchy, in their order, then the world's origin.

    Parents of moving nodes that do not move themselves are kept too, with their matrix below the next moving node.
    versions: both skeletons of K nodes. nodes: (K,) indices of the kept ones among all N, −1 for the origin.
    anchors: (N + 1,) index in `nodes` of the nearest node that moves, itself or above it, else of the origin; the last
    one is that of −1, the world.
    offsets: (N + 1, 3, 4) anchor_from_node, the same in both versions.
    """

    versions: tuple[Skeleton, Skeleton]
    nodes: Ints
    anchors: Ints
    offsets: Floats

    @property
    def origin(self) -> int:
        """Index in `nodes` of the world's origin."""
        return len(self.nodes) - 1

    def clip(self, clip: Clip) -> Clip:
        """Return a clip of moving nodes for the kept ones."""
        animated = np.array([t.node for t in clip.tracks if t.node is not None], np.int64)
        if (self.nodes[self.anchors[animated]] != animated).any():
            raise ValueError("the clip moves nodes that were taken for static")
        return replace(
            clip,
            tracks=tuple(t if t.node is None else replace(t, node=int(self.anchors[t.node])) for t in clip.tracks),
        )


def reduce_skeletons(
    one: Skeleton, other: Skeleton, clips: Iterable[Clip], more: Iterable[int]
) -> ReducedSkeleton | None:
    """Return two skeletons without the nodes that are static in both and have no moving child.

    None if they are small, differ in hierarchy, or mostly move. clips: all that will be played, of either skeleton.
    more: nodes to keep as they are.
    """
    if len(one) < MIN_NODES or not (np.array_equal(one.parents, other.parents) and _same(one.sheared, other.sheared)):
        return None
    tracks = {(track.node, track.path, track.pointer) for clip in clips for track in clip.tracks}
    if any(node is None and parse_weight_pointer(pointer) is not None for node, _, pointer in tracks):
        return None
    moves = _differ(one, other)
    moves[[node for node, *_ in tracks if node is not None]] = True
    moves[list(more)] = True
    above = one.parents[moves]
    kept = moves.copy()
    kept[above[above >= 0]] = True
    return _reduce(one, other, moves, kept) if kept.sum() < MAX_MOVING_FRACTION * len(one) else None


def _same(one: Ints | Floats, other: Ints | Floats) -> bool:
    return one is other or np.array_equal(one, other)


def _differ(one: Skeleton, other: Skeleton) -> Bools:
    """Mask (N,) of the nodes with different transforms at rest."""
    found = np.zeros(len(one), np.bool_)
    if one is other:
        return found
    for name in ("translation", "rotation", "scale"):
        found |= (getattr(one, name) != getattr(other, name)).any(axis=1)
    found[one.sheared] |= (one.sheared_local != other.sheared_local).any(axis=(1, 2))
    return found


def _reduce(one: Skeleton, other: Skeleton, moves: Bools, kept: Bools) -> ReducedSkeleton:
    local = local_by_node(one, rest_pose(one))[:, 0]
    local[moves] = IDENTITY
    rotation = np.where(moves[:, None], (0.0, 0.0, 0.0, 1.0), one.rotation)
    above = np.where(moves, -1, one.parents)
    offsets = matrix.accumulate_from_tops(local, above, one.levels())
    turned = hierarchy.with_ancestors(above, kept & ~moves)
    rotations = _accumulate_rotations(rotation, np.where(turned, above, -1))
    nodes = np.flatnonzero(kept)
    index = np.full(len(one) + 1, len(nodes))  # of what is not kept: the origin
    index[nodes] = np.arange(len(nodes))
    anchors = np.append(index[nearest_at_or_above(one.parents, moves)], len(nodes))
    parents = np.where(moves[nodes], index[one.parents[nodes]], anchors[nodes])
    versions = [_version(each, nodes, parents, moves, offsets, rotations) for each in (one, other)]
    return ReducedSkeleton(
        (versions[0], versions[0] if other is one else versions[1]),
        np.append(nodes, -1),
        anchors,
        np.concatenate((offsets, IDENTITY)),
    )


def _version(
    skeleton: Skeleton, nodes: Ints, parents: Ints, moves: Bools, offsets: Floats, rotations: Floats
) -> Skeleton:
    """The kept nodes: of static ones the whole transform below the next moving node is theirs."""
    is_static = ~moves[nodes]
    sheared = dict(zip(skeleton.sheared.tolist(), skeleton.sheared_local, strict=True))
    sheared |= {int(node): offsets[node] for node in nodes[is_static]}
    whole = [i for i, node in enumerate(nodes.tolist()) if node in sheared]
    return Skeleton(
        (*(skeleton.names[node] for node in nodes.tolist()), ""),
        np.append(parents, -1),
        np.append(skeleton.translation[nodes], [[0.0, 0.0, 0.0]], axis=0),
        np.append(np.where(is_static[:, None], rotations[nodes], skeleton.rotation[nodes]), [[0, 0, 0, 1.0]], axis=0),
        np.append(skeleton.scale[nodes], [[1.0, 1.0, 1.0]], axis=0),
        np.array(whole, np.int64),
        np.array([sheared[node] for node in nodes[whole].tolist()]).reshape(-1, 3, 4),
    )


def _accumulate_rotations(rotations: Floats, parents: Ints) -> Floats:
    """The products of rotations from each node's root on, in as many steps."""
    rotations, parents = rotations.copy(), parents.copy()
    while len(some := np.flatnonzero(parents >= 0)):
        above = parents[some]
        rotations[some] = quaternion.normalize(quaternion.multiply(rotations[above], rotations[some]))
        parents[some] = parents[above]
    return rotations
