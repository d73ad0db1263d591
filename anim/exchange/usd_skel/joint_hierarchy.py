"""Joints of a skeleton with the nodes between them, and the node below which they are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Container, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Ints
from anim.model import Skeleton
from anim.model.skeleton import ancestors


class JointHierarchy(NamedTuple):
    """The node below which the joints are, −1 for none; the joints, parents first; their parents (J,) among them."""

    anchor: int
    joints: tuple[int, ...]
    parents: Ints


class NodeOrder:
    """Nodes by level, of a scene with many skeletons.

    parents: (N,), −1 for roots.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.parents: list[int] = skeleton.parents.tolist()
        self.nodes: list[int] = [node for level in skeleton.levels() for node in level.tolist()]
        self._place = [0] * len(self.nodes)
        for place, node in enumerate(self.nodes):
            self._place[node] = place

    def sorted(self, nodes: Collection[int]) -> list[int]:
        """Return nodes by level, those of a level in the order of the file."""
        return sorted(nodes, key=self._place.__getitem__)


def join_joints(joints: Collection[int], order: NodeOrder, animated: Container[int]) -> JointHierarchy:
    """Return the hierarchy of joints: nothing above its anchor moves, nodes between joints are joints too."""
    parents = order.parents
    anchor = _nearest_above_all(joints, parents)
    moving = [node for node in (anchor, *ancestors(parents, anchor)) if node >= 0 and node in animated]
    if moving:
        anchor = parents[moving[-1]]
    found = tuple(_depth_first(order.sorted(_with_those_above(joints, parents, anchor)), parents))
    number = {node: i for i, node in enumerate(found)}
    return JointHierarchy(anchor, found, np.array([number.get(parents[node], -1) for node in found], np.int64))


def _nearest_above_all(joints: Collection[int], parents: Sequence[int]) -> int:
    """The nearest node above all joints, −1 for none: from the roots down to the first joint or branch."""
    whole = _with_those_above(joints, parents, -1)
    num_children = Counter(parents[node] for node in whole)
    only_child = {parents[node]: node for node in whole}
    own, found = set(joints), -1
    while num_children[found] == 1 and only_child[found] not in own:
        found = only_child[found]
    return found


def _with_those_above(joints: Collection[int], parents: Sequence[int], anchor: int) -> set[int]:
    """The joints and the nodes above them that are below an anchor."""
    found = set(joints)
    for joint in joints:
        node = parents[joint]
        while node != anchor and node not in found:
            found.add(node)
            node = parents[node]
    return found


def _depth_first(order: Sequence[int], parents: Sequence[int]) -> list[int]:
    """The nodes, given by level, so that each is followed by its descendants."""
    children: dict[int, list[int]] = {}
    inside = set(order)
    for node in order:
        children.setdefault(parents[node] if parents[node] in inside else -1, []).append(node)
    found, stack = [], children.get(-1, [])[::-1]
    while stack:
        node = stack.pop()
        found.append(node)
        stack.extend(reversed(children.get(node, ())))
    return found
