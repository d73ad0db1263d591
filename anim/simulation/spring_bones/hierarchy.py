"""Check of spring bones against a skeleton: nodes, chains, centers and colliders fit together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.errors import AnimError, FormatError, NotFoundError, UnsupportedError
from anim.maths import hierarchy, matrix
from anim.model import Skeleton
from anim.sampling import rest_world
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, chain_label

SCALE_TOLERANCE = 1e-3  # of a scale of 1
MAX_TAIL_NODES = 32  # between a joint and its tail, which is mostly its child
MIN_NOTED_ANGLE_DEG = 1.0  # between a bone as drawn and as simulated; less is hardly seen


def check_hierarchy(skeleton: Skeleton, bones: SpringBones) -> None:
    """Raise an error, with the chain's label, unless the chains can be simulated on `skeleton`.

    Every node exists; a joint belongs to one chain, and its tail is one of its descendants; a center is the first joint
    or an ancestor of it; a collider is not moved by a joint that collides with it. Raises FormatError otherwise, and
    UnsupportedError for a joint that `check_rotatable` refuses, or whose tail is over MAX_TAIL_NODES below it.
    """
    owners: dict[int, int] = {}
    subtrees = hierarchy.find_subtrees(skeleton.parents)
    depths = hierarchy.find_depths(skeleton.parents)
    for i, collider in enumerate(bones.colliders):
        if collider.node is not None:
            _check_node(skeleton, collider.node, f"collider {i}")
    for i, chain in enumerate(bones.chains):
        try:
            _check_chain(skeleton, subtrees, depths, bones, chain)
        except AnimError as error:
            raise error.at(chain_label(bones.chains, i)) from None
        for joint in chain.joints:
            if (other := owners.setdefault(joint.node, i)) != i:
                raise FormatError(
                    f"{skeleton.label(joint.node)} is a joint of {chain_label(bones.chains, other)} and of "
                    f"{chain_label(bones.chains, i)} (expected one spring for each joint)"
                )


def _check_chain(
    skeleton: Skeleton, subtrees: tuple[Ints, Ints], depths: Ints, bones: SpringBones, chain: SpringChain
) -> None:
    seen: set[int] = set()
    for joint in chain.joints:
        _check_joint(skeleton, subtrees, depths, joint)
        if joint.node in seen:
            raise FormatError(f"{skeleton.label(joint.node)} is a joint twice (expected once)")
        seen.add(joint.node)
        for index in chain.colliders:
            _check_collider(skeleton, subtrees, bones, index, joint)
    if chain.center is not None and chain.joints:
        _check_node(skeleton, chain.center, "center")
        first = chain.joints[0].node
        if first != chain.center and not hierarchy.is_below(subtrees, first, chain.center):
            raise FormatError(
                f"center is {skeleton.label(chain.center)} (expected {skeleton.label(first)} or one of its ancestors)"
            )


def check_rotatable(skeleton: Skeleton, node: int) -> None:
    """Raise UnsupportedError for a node with a matrix that has no translation, rotation and scale."""
    if node in skeleton.sheared:
        raise UnsupportedError(
            f"{skeleton.label(node)} has a sheared or singular matrix, which no rotation can animate"
        )


def _check_joint(skeleton: Skeleton, subtrees: tuple[Ints, Ints], depths: Ints, joint: SpringJoint) -> None:
    _check_node(skeleton, joint.node, "joint")
    check_rotatable(skeleton, joint.node)
    if joint.tail is None:
        return
    _check_node(skeleton, joint.tail, "joint")
    if not hierarchy.is_below(subtrees, joint.tail, joint.node):
        raise FormatError(
            f"{skeleton.label(joint.tail)} follows {skeleton.label(joint.node)} (expected one of its descendants)"
        )
    if (count := int(depths[joint.tail] - depths[joint.node])) > MAX_TAIL_NODES:
        raise UnsupportedError(
            f"the tail of {skeleton.label(joint.node)} is {count} nodes below it, {skeleton.label(joint.tail)} (limit "
            f"{MAX_TAIL_NODES})",
            help="make the nodes between them joints of the spring",
        )


def _check_collider(
    skeleton: Skeleton, subtrees: tuple[Ints, Ints], bones: SpringBones, index: int, joint: SpringJoint
) -> None:
    if not 0 <= index < len(bones.colliders):
        raise FormatError(f"there is no collider {index} (there are {len(bones.colliders)}, from 0 on)")
    collider = bones.colliders[index]
    moved = collider.node is not None and hierarchy.is_below(subtrees, collider.node, joint.node)
    if collider.node is not None and (moved or collider.node == joint.node):
        raise FormatError(
            f"{skeleton.label(joint.node)} collides with collider {index}, which it moves itself: the collider is on "
            f"{skeleton.label(collider.node)}",
            help="put the collider on a node above the spring's joints, or take it out of the spring's colliders",
        )


def _check_node(skeleton: Skeleton, node: int, what: str) -> None:
    if not 0 <= node < len(skeleton):
        raise NotFoundError(f"there is no node {node} for a {what} (the file has {len(skeleton)}, from 0 on)")


def scaled_colliders(skeleton: Skeleton, bones: SpringBones) -> tuple[str, ...]:
    """Return a note for each collider in use on a node with a world scale other than 1: its radius is not scaled."""
    matrices = rest_world(skeleton)
    notes = []
    for index in sorted({index for chain in bones.chains for index in chain.colliders}):
        collider = bones.colliders[index]
        if collider.node is None or collider.radius == 0:
            continue
        scale = np.linalg.norm(matrices[collider.node, :, :3], axis=0)
        if np.abs(scale - 1).max() > SCALE_TOLERANCE:
            notes.append(
                f"collider {index} on {skeleton.label(collider.node)} has a scale of {scale.max():.4g}, its radius of "
                f"{collider.radius:.4g} m is not scaled, as in players"
            )
    return tuple(notes)


def uneven_joints(skeleton: Skeleton, bones: SpringBones) -> tuple[str, ...]:
    """Return a note for each joint whose own scale at rest turns its bone, which spring bones don't count.

    The scales of nodes above it do count.
    """
    notes = []
    can_turn = (np.ptp(skeleton.scale, axis=1) > 0) | (skeleton.scale < 0).any(axis=1)
    for joint in (joint for chain in bones.chains for joint in chain.joints if can_turn[joint.node]):
        tail, scale = tail_at_rest(skeleton, joint), skeleton.scale[joint.node]
        drawn = scale * tail
        angle = float(np.degrees(np.arctan2(np.linalg.norm(np.cross(tail, drawn)), tail @ drawn)))
        if np.abs(drawn).max() > 0 and angle > MIN_NOTED_ANGLE_DEG:
            sizes = " × ".join(f"{each:.4g}" for each in scale)
            notes.append(
                f"{skeleton.label(joint.node)} has a non-uniform scale, {sizes}: its bone is drawn {angle:.2g}° from "
                "where it swings, as in players"
            )
    return tuple(notes)


def moving_nodes(skeleton: Skeleton, bones: SpringBones) -> Bools:
    """Return a mask (N,) of the nodes that a spring moves: its joints and everything below."""
    found = np.zeros(len(skeleton), np.bool_)
    found[list(bones.nodes)] = True
    for level in skeleton.levels()[1:]:
        found[level] |= found[skeleton.parents[level]]
    return found


def tail_at_rest(skeleton: Skeleton, joint: SpringJoint) -> Floats:
    """Return the tail (3,) of a joint in its own space, at rest."""
    if joint.tail is None:
        return np.array(joint.tail_offset)
    point: Floats = skeleton.translation[joint.tail]
    node = int(skeleton.parents[joint.tail])
    while node != joint.node:
        local = matrix.from_trs(skeleton.translation[node], skeleton.rotation[node], skeleton.scale[node])
        point = matrix.apply(local, point[None])[0]
        node = int(skeleton.parents[node])
    return point


def scale_bones(skeleton: Skeleton, bones: SpringBones) -> SpringBones:
    """Return the chains with stiffness, gravity and radii times the world scale of their nodes at rest.

    A scaled model then moves by the same angles as the model without scale; of unequal scales the largest counts.
    """
    scales = np.linalg.norm(rest_world(skeleton)[:, :, :3], axis=1).max(axis=1).tolist()

    def scaled(joint: SpringJoint) -> SpringJoint:
        own, factor = joint.parameters, scales[joint.node]
        x, y, z = own.gravity
        gravity = (factor * x, factor * y, factor * z)
        changed = replace(own, stiffness=factor * own.stiffness, hit_radius=factor * own.hit_radius, gravity=gravity)
        return replace(joint, parameters=changed)

    chains = tuple(replace(chain, joints=tuple(map(scaled, chain.joints))) for chain in bones.chains)
    colliders = (
        each if each.node is None else replace(each, radius=scales[each.node] * each.radius) for each in bones.colliders
    )
    return replace(bones, chains=chains, colliders=tuple(colliders))
