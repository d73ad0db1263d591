"""Anchor of each matched joint, and the evaluation order of all target nodes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

from anim.maths import hierarchy
from anim.model import Skeleton
from anim.model.skeleton import ancestors, nearest_ancestors, node_mask

Pair: TypeAlias = tuple[int, int]  # a source node and a target node
NONE: Pair = (-1, -1)


def find_anchors(source: Skeleton, target: Skeleton, pairs: Mapping[int, int]) -> dict[int, Pair]:
    """Return each matched target node's anchor pair; (−1, −1) for nodes that carry the root path.

    The anchor is the nearest matched ancestor, in the skeleton with the nearer one: a foot of an IK rig, which descends
    from the root, is positioned relative to the lower leg if that is its parent in the other skeleton.
    """
    back = {b: a for a, b in pairs.items()}
    above_source, above_target = (
        nearest_ancestors(each.parents, node_mask(each, matched)) for each, matched in ((source, pairs), (target, back))
    )
    subtrees = hierarchy.find_subtrees(target.parents)
    found: dict[int, Pair] = {}
    for a, b in pairs.items():
        up = int(above_source[a])
        in_source = (up, pairs[up]) if up >= 0 else NONE
        up = int(above_target[b])
        in_target = (back[up], up) if up >= 0 else NONE
        both = NONE not in (in_source, in_target)
        is_nearer = not (both and hierarchy.is_below(subtrees, in_target[1], in_source[1]))
        depends = in_source[1] == b or (in_source != NONE and hierarchy.is_below(subtrees, in_source[1], b))
        found[b] = in_source if in_source != NONE and is_nearer and not depends else in_target
    return found


def evaluation_order(target: Skeleton, chosen: dict[int, Pair], pairs: Mapping[int, int]) -> list[int]:
    """Return all target nodes, each after its parent and its anchor.

    In a cycle of anchors, one is replaced in `chosen` by the nearest matched ancestor.
    """
    back = {b: a for a, b in pairs.items()}
    waiting = [node for level in target.levels() for node in level.tolist()]
    done: dict[int, None] = {-1: None}
    while waiting:
        before = len(waiting)
        waiting = [node for node in waiting if not _is_ready(target, node, chosen, done)]
        if len(waiting) == before:
            node = next(n for n in waiting if int(target.parents[n]) in done)
            chosen[node] = next(((back[up], up) for up in ancestors(target.parents, node) if up in back), NONE)
    return [node for node in done if node >= 0]


def _is_ready(target: Skeleton, node: int, chosen: Mapping[int, Pair], done: dict[int, None]) -> bool:
    """True if a node's parent and anchor are done; the node is then added to `done`."""
    ready = int(target.parents[node]) in done and chosen.get(node, NONE)[1] in done
    if ready:
        done[node] = None
    return ready
