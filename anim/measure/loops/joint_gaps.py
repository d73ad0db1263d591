"""Joints that are open at the ends of a time range, each with its own loop gap."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hierarchy, matrix
from anim.measure.error.surface import Surface
from anim.measure.loops.carried_distance import carried_distances
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip, Pose
from anim.sampling.pose import sample_pose


class JointGap(NamedTuple):
    """A joint with its own loop gap. joint: its name. node: its index.

    gap: m, the largest distance that any vertex would move if this joint alone ended as it starts.
    is_morph: whether it is a mesh with open morph weights.
    """

    joint: str
    node: int
    gap: float
    is_morph: bool = False


def joint_gaps(skin: SkinMotion, clip: Clip, start: float, end: float, root: int = -1) -> list[JointGap]:
    """Return the joints whose pose at `end` differs from that at `start`, the largest gap first.

    The translation of `root` does not count. Morph weights count for the node of their mesh.
    """
    both = sample_pose(skin.skeleton, clip, np.array([start, end]))
    nodes = _moved_between(both, root)
    rows = [
        JointGap(skin.skeleton.display_name(node), node, gap)
        for node, gap in zip(nodes.tolist(), carried_distances(skin, both, nodes, root).tolist(), strict=True)
    ]
    for node, weights in both.weights.items():
        change = _morphed(skin, node, weights[1] - weights[0])
        rows.append(JointGap(skin.skeleton.display_name(node), node, change, is_morph=True))
    return sorted((each for each in rows if each.gap > 0), key=lambda each: (-each.gap, each.node))


def moving_nodes(skin: SkinMotion, clip: Clip, start: float, end: float, frame: float, root: int = -1) -> set[int]:
    """Return the nodes with points that move in the first or in the last frame."""
    frames = (np.array([start, start + frame]), np.array([end - frame, end]))
    found = [_moved_between(sample_pose(skin.skeleton, clip, times), root) for times in frames]
    carrying = _carrying(skin)
    return {node for node in np.concatenate(found).tolist() if carrying[node]}


def _carrying(skin: SkinMotion) -> Bools:
    """Mask (N,) of the nodes with points on them or on their descendants."""
    points, carrying = skin.points, np.zeros(len(skin.skeleton), np.bool_)
    carrying[points.nodes[points.joints[points.factors[..., 3] > 0]]] = True
    return hierarchy.with_ancestors(skin.skeleton.parents, carrying)


def _moved_between(both: Pose, root: int) -> Ints:
    """Indices of nodes with different local transforms in the two frames of a pose; q and −q are equal."""
    differs = (both.scale[0] != both.scale[1]).any(axis=1)
    differs |= np.minimum(*(np.abs(both.rotation[0] - s * both.rotation[1]).max(axis=1) for s in (1, -1))) > 0
    shifted = (both.translation[0] != both.translation[1]).any(axis=1)
    if root >= 0:
        shifted[root] = False
    return np.flatnonzero(differs | shifted)


def _morphed(skin: SkinMotion, node: int, change: Floats) -> float:
    """Largest distance, in metres, that a change of morph weights (M,) moves a vertex of a node's mesh."""
    mine = [part for part in skin.surfaces if part.owner == node and len(part.targets) == len(change)]
    return max((_widening(skin, part) * _longest(np.tensordot(change, part.targets, 1)) for part in mine), default=0)


def _widening(skin: SkinMotion, part: Surface) -> float:
    """Largest length in metres of one unit of a mesh's space, in the rest pose."""
    world = matrix.multiply(skin.rest_world[part.nodes, 0], part.bind)
    return float(np.sqrt((world[..., :3] ** 2).sum(axis=-2)).max())


def _longest(vectors: Floats) -> float:
    return float(np.sqrt((vectors * vectors).sum(axis=-1)).max(initial=0.0))
