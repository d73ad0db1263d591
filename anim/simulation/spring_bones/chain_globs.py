"""Spring chains below nodes that a user names."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from anim.arrays import group_indices
from anim.errors import NotFoundError
from anim.maths import hierarchy
from anim.model import Skeleton
from anim.model.skeleton import node_mask
from anim.operations.selection import match_names
from anim.simulation.spring_bones.chains import SpringChain, SpringJoint, SpringParameters
from anim.simulation.spring_bones.colliders import ORIGIN, Vector
from anim.simulation.spring_bones.hierarchy import check_rotatable, tail_at_rest


def find_chains(
    skeleton: Skeleton,
    globs: Sequence[str],
    parameters: SpringParameters,
    *,
    skin_joints: Collection[int] = (),
    colliders: Sequence[int] = (),
    center: int | None = None,
) -> tuple[SpringChain, ...]:
    """Return a chain for each topmost node that matches one of the globs, with all joints below it.

    skin_joints: joints of the file's skins; a chain that begins with one has no other nodes, so that what is attached
    to it only follows. At a branch the first joint below is the tail. The last joint of a branch has the next node as
    its tail, or a point as far from it as it is from its parent, in the same direction.
    Raises NotFoundError, with similar names, for a glob that matches no node, or if no match can be a chain.
    find_chains(skeleton, ["Tail*"], SpringParameters()): "Tail1" and all below, if "Tail2" and "Tail3" are below it
    """
    names = [name or f"#{i}" for i, name in enumerate(skeleton.names)]
    matched = match_names(globs, names, "node")
    is_inside = np.append(hierarchy.with_descendants(skeleton.parents, node_mask(skeleton, matched)), False)
    children = group_indices(skeleton.parents.tolist())
    chains = []
    for root in (node for node in matched if not is_inside[skeleton.parents[node]]):  # the last: above a root
        allowed = frozenset(skin_joints) if root in skin_joints else None
        joints = _joints(skeleton, root, children, parameters, allowed)
        if joints:
            chains.append(SpringChain(skeleton.names[root], joints, tuple(colliders), center))
    if not chains:
        raise NotFoundError(
            f"no chain begins at {skeleton.label(matched[0])}: it has no length",
            help="name the first joint of a chain: its children, or its distance to its parent, give its length",
        )
    return tuple(chains)


def drop_inert_joints(skeleton: Skeleton, chains: Sequence[SpringChain]) -> tuple[tuple[SpringChain, ...], list[str]]:
    """Return the chains without joints that can't swing, and a note for each of those.

    A joint can't swing if its tail is where it is itself: no rotation moves it.
    """
    notes: list[str] = []
    kept = []
    for chain in chains:
        joints = []
        for joint in chain.joints:
            if _length(skeleton, joint) > 0:
                joints.append(joint)
            else:
                notes.append(f"{skeleton.label(joint.node)} does not swing: its tail has the same position")
        if joints:
            kept.append(SpringChain(chain.name, tuple(joints), chain.colliders, chain.center))
    return tuple(kept), notes


def _joints(
    skeleton: Skeleton,
    root: int,
    children: dict[int, list[int]],
    parameters: SpringParameters,
    allowed: frozenset[int] | None,
) -> tuple[SpringJoint, ...]:
    joints = []
    waiting = [root]
    while waiting:
        node = waiting.pop()
        check_rotatable(skeleton, node)
        every = children.get(node, [])
        next_joints = [child for child in every if allowed is None or child in allowed]
        away = [child for child in (next_joints or every) if skeleton.translation[child].any()]
        offset = ORIGIN if away else _vector(skeleton, node)
        if away or any(offset):
            joints.append(SpringJoint(node, away[0] if away else None, parameters, offset))
        waiting.extend(reversed(next_joints))
    return tuple(joints)


def _vector(skeleton: Skeleton, node: int) -> Vector:
    """The node's own offset from its parent, in its own space."""
    x, y, z = skeleton.translation[node].tolist()
    return x, y, z


def _length(skeleton: Skeleton, joint: SpringJoint) -> float:
    return float(np.linalg.norm(tail_at_rest(skeleton, joint)))
