"""Order of evaluation: nodes that depend on springs, level by level, and their rows in the array of world matrices."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from anim.arrays import Ints
from anim.errors import FormatError, UnsupportedError
from anim.model import Skeleton
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, chain_label
from anim.simulation.spring_bones.hierarchy import moving_nodes

MAX_LEVELS = 512  # of joints below each other, each of which takes 65 µs a step; hair and ropes have tens


@dataclass(frozen=True, slots=True)
class PlannedJoint:
    """A joint with its chain, and its index among all joints of the simulation."""

    index: int
    chain: SpringChain
    joint: SpringJoint


@dataclass(frozen=True, slots=True)
class Level:
    """Nodes whose dependencies all are in earlier levels: joints by batch, and nodes that only follow their parent."""

    batches: tuple[tuple[PlannedJoint, ...], ...]
    followers: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Plan:
    """Evaluation order of a simulation.

    driven: nodes that no spring moves, parents first; their rows are 0 … D − 1.
    rows: (N + 1,) row of each node, and last that of the scene, which is the last row; nodes of a level are contiguous.
    """

    driven: Ints
    levels: tuple[Level, ...]
    rows: Ints

    @property
    def num_rows(self) -> int:
        """Number of world matrices, the scene's included."""
        return int(self.rows[-1]) + 1


def make_plan(skeleton: Skeleton, bones: SpringBones) -> Plan:
    """Return the evaluation order of checked chains.

    Raises FormatError if springs depend on each other in a circle: each collides with a collider that the other moves,
    and UnsupportedError for more than MAX_LEVELS levels.
    """
    moving = moving_nodes(skeleton, bones)
    needed = _needed_nodes(skeleton, bones)
    joints = _planned_joints(bones)
    depth = _depths(skeleton, bones, {int(n) for n in needed if moving[n]}, joints)
    if (count := max(depth.values(), default=0)) > MAX_LEVELS:
        raise UnsupportedError(
            f"{count} nodes below each other move with springs (limit {MAX_LEVELS})",
            help="make the chains shorter",
        )
    driven = np.array([n for n in needed if not moving[n]], np.int64)
    levels = []
    order = list(driven)
    by_depth: dict[int, list[int]] = {}
    for node in sorted(depth):
        by_depth.setdefault(depth[node], []).append(node)
    for nodes in (by_depth[number] for number in sorted(by_depth)):
        followers = tuple(node for node in nodes if node not in joints)
        batches = _batches(joints[node] for node in nodes if node in joints)
        levels.append(Level(batches, followers))
        order += [*followers, *(each.joint.node for batch in batches for each in batch)]
    rows = np.full(len(skeleton) + 1, len(order))
    rows[order] = np.arange(len(order))
    return Plan(driven, tuple(levels), rows)


def _planned_joints(bones: SpringBones) -> dict[int, PlannedJoint]:
    pairs = [(chain, joint) for chain in bones.chains for joint in chain.joints]
    return {joint.node: PlannedJoint(i, chain, joint) for i, (chain, joint) in enumerate(pairs)}


def _needed_nodes(skeleton: Skeleton, bones: SpringBones) -> list[int]:
    """Joints, centers, nodes of colliders, and all their ancestors; parents first."""
    needed = np.zeros(len(skeleton), np.bool_)
    needed[list(bones.nodes)] = True
    needed[[chain.center for chain in bones.chains if chain.center is not None]] = True
    used = {index for chain in bones.chains for index in chain.colliders}
    needed[[node for i in used if (node := bones.colliders[i].node) is not None]] = True
    levels = skeleton.levels()
    for level in reversed(levels[1:]):
        needed[skeleton.parents[level[needed[level]]]] = True
    return [int(node) for level in levels for node in level[needed[level]]]


def _depths(
    skeleton: Skeleton, bones: SpringBones, moving: set[int], joints: dict[int, PlannedJoint]
) -> dict[int, int]:
    """The level of each moving node, from 1 on: 1 more than the deepest of its dependencies."""
    waiting = {node: _dependencies(skeleton, bones, node, joints.get(node)) & moving for node in sorted(moving)}
    followers: dict[int, list[int]] = {}
    for node, needs in waiting.items():
        for each in needs:
            followers.setdefault(each, []).append(node)
    missing = {node: len(needs) for node, needs in waiting.items()}
    ready = [node for node, count in missing.items() if not count]
    depth = dict.fromkeys(ready, 1)
    for node in ready:  # which grows: nodes follow when the last of what they need is there
        for each in followers.get(node, ()):
            depth[each] = max(depth.get(each, 0), depth[node] + 1)
            missing[each] -= 1
            if not missing[each]:
                ready.append(each)
    if len(ready) < len(waiting):
        raise _circle(skeleton, bones, next(joints[node] for node in waiting if missing[node] and node in joints))
    return depth


def _dependencies(skeleton: Skeleton, bones: SpringBones, node: int, planned: PlannedJoint | None) -> set[int]:
    needs = {int(skeleton.parents[node])}
    if planned is not None:
        nodes = {bones.colliders[index].node for index in planned.chain.colliders} | {planned.chain.center}
        needs |= {each for each in nodes if each is not None and each != node}
    return needs


def _circle(skeleton: Skeleton, bones: SpringBones, planned: PlannedJoint) -> FormatError:
    return FormatError(
        f"{skeleton.label(planned.joint.node)} depends on itself, through colliders or centers that springs move",
        where=chain_label(bones.chains, bones.chains.index(planned.chain)),
        help="put the colliders on nodes above the springs' joints, or take them out of the springs' colliders",
    )


def _batches(joints: Iterable[PlannedJoint]) -> tuple[tuple[PlannedJoint, ...], ...]:
    """Joints that are computed by the same formulas, side by side."""
    groups: dict[tuple[bool, bool], list[PlannedJoint]] = {}
    for each in joints:
        key = each.joint.parameters.frequency is not None, each.chain.center is not None
        groups.setdefault(key, []).append(each)
    return tuple(map(tuple, groups.values()))
