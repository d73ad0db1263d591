"""Joints that are open at the ends of a time range, each with its own loop gap."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hierarchy, matrix
from anim.measure.error.surface import Surface
from anim.measure.loops.carried_distance import carried_distances
from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Pose
from anim.sampling.clips import sample_clips


class JointGap(NamedTuple):
    """A joint with its own loop gap. joint: its name. node: its index in the whole scene.

    gap: m, the largest distance that any vertex would move if this joint alone ended as it starts.
    is_morph: whether it is a mesh with open morph weights.
    """

    joint: str
    node: int
    gap: float
    is_morph: bool = False


def joint_gaps(skin: SkinMotion, parts: Sequence[LoopRange]) -> list[list[JointGap]]:
    """Return for each range the joints whose pose at its end differs from that at its start, the largest gap first.

    The translation of its root does not count. Morph weights count for the node of their mesh.
    """
    found: list[list[JointGap]] = []
    for some in _blocks(skin, parts, 2):
        (start, end), weights = _sample(skin, some, [(each.start, each.end) for each in some])
        roots = np.array([each.root for each in some])
        clip, nodes = np.nonzero(_is_moved(start, end, roots))
        gaps = carried_distances(skin, (start, end), clip, nodes, roots)
        found += _by_clip(skin, weights, clip, nodes, gaps)
    return found


def _by_clip(
    skin: SkinMotion, weights: Sequence[Mapping[int, Floats]], clip: Ints, nodes: Ints, gaps: Floats
) -> list[list[JointGap]]:
    """The joints of each clip, sorted. weights: (2, M) by node, of each clip. clip, nodes, gaps: (K,)."""
    rows: list[list[JointGap]] = [[] for _ in weights]
    for i, node, gap in zip(clip.tolist(), nodes.tolist(), gaps.tolist(), strict=True):
        if gap > 0:
            rows[i].append(JointGap(skin.skeleton.display_name(node), int(skin.nodes[node]), gap))
    for row, morphs in zip(rows, weights, strict=True):
        for node, each in morphs.items():
            if (change := _morphed(skin, node, each[1] - each[0])) > 0:
                name, number = skin.skeleton.display_name(node), int(skin.nodes[node])
                row.append(JointGap(name, number, change, is_morph=True))
        row.sort(key=lambda each: (-each.gap, each.node))
    return rows


def moving_nodes(skin: SkinMotion, parts: Sequence[LoopRange]) -> list[set[int]]:
    """Return for each range the nodes, of the whole scene, with points that move in its first or in its last frame."""
    carrying = _carrying(skin)
    found: list[set[int]] = []
    for some in _blocks(skin, parts, 4):
        times = [(each.start, each.start + each.frame, each.end - each.frame, each.end) for each in some]
        (first, second, before_last, last), _ = _sample(skin, some, times)
        roots = np.array([each.root for each in some])
        moves = carrying & (_is_moved(first, second, roots) | _is_moved(before_last, last, roots))
        found += [set(skin.nodes[each].tolist()) for each in moves]
    return found


def _blocks(skin: SkinMotion, parts: Sequence[LoopRange], times: int) -> Iterator[Sequence[LoopRange]]:
    """Yield the ranges in blocks whose poses at so many times each take little memory."""
    size = skin.posed_at_once(times)
    yield from (parts[first : first + size] for first in range(0, len(parts), size))


def _sample(
    skin: SkinMotion, parts: Sequence[LoopRange], times: Sequence[tuple[float, ...]]
) -> tuple[list[Pose], list[dict[int, Floats]]]:
    """Poses of R frames, one for each range, at the first, second … of its times; and its morph weights by node."""
    at = np.array(times)
    pose, weights = sample_clips(skin.skeleton, [each.clip for each in parts], at)
    count = at.shape[1]
    every = [slice(i, None, count) for i in range(count)]
    return [Pose(pose.times[i], pose.translation[i], pose.rotation[i], pose.scale[i]) for i in every], weights


def _carrying(skin: SkinMotion) -> Bools:
    """Mask (N,) of the nodes with points on them or on their descendants."""
    points, carrying = skin.points, np.zeros(len(skin.skeleton), np.bool_)
    carrying[points.nodes[points.joints[points.factors[..., 3] > 0]]] = True
    return hierarchy.with_ancestors(skin.skeleton.parents, carrying)


def _is_moved(before: Pose, after: Pose, roots: Ints) -> Bools:
    """Mask (R, N) of nodes with other local transforms in `after` than in `before`, R frames each; q and −q are equal.

    roots: (R,) nodes whose translation doesn't count, −1 for none.
    """
    differs = (before.scale != after.scale).any(axis=2)
    differs |= np.minimum(*(np.abs(before.rotation - s * after.rotation).max(axis=2) for s in (1, -1))) > 0
    shifted = (before.translation != after.translation).any(axis=2)
    has_root = np.flatnonzero(roots >= 0)
    shifted[has_root, roots[has_root]] = False
    return np.asarray(differs | shifted)


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
