"""secondaryAnimation of VRM 0.x → SpringBones.

Every descendant of a listed bone is a joint, and its first child is the tail; the last joint of a branch gets a tail of
7 cm along its own translation. Positions and directions are those of Unity, whose z axis is opposite to glTF's.
Source: VRM 0.x schema ("stiffiness" is its spelling); For `vrm0` in VRMC_springBone 1.0; UniVRM's defaults.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from anim.gltf.document import Json, json_array
from anim.gltf.validation.rules import ObjectRule, WholeNumber, check_property, index, list_of, number, text
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, SpringParameters
from anim.simulation.spring_bones.colliders import Collider, ColliderShape, Vector
from anim.simulation.spring_bones.json_values import JointSprings, count_items, locate

EXTENSION = "VRM"
DEFAULT_STIFFNESS, DEFAULT_DRAG, DEFAULT_HIT_RADIUS_M = 1.0, 0.4, 0.02  # UniVRM's
LAST_TAIL_M = 0.07  # of the last joint of a branch


def read(extension: Any, json: Json) -> SpringBones:
    """Return the chains and colliders of the extension's JSON. json: that of the whole file."""
    colliders = read_colliders(extension, json)
    animation = _animation(extension)
    nodes = json_array(json, "nodes")
    ends = np.cumsum([0, *(len(group.get("colliders", [])) for group in animation.get("colliderGroups", []))]).tolist()
    groups = [range(*each) for each in pairwise(ends)]
    joints = JointSprings(nodes)
    branches = [
        [
            _nodes_below(root, nodes, joints, f"boneGroups[{i}].bones[{k}]")
            for k, root in enumerate(group.get("bones", []))
        ]
        for i, group in enumerate(animation.get("boneGroups", []))
    ]
    chains: list[SpringChain] = []
    for i, group in enumerate(animation.get("boneGroups", [])):
        chains += locate(f"boneGroups[{i}]", _chains, group, branches[i], nodes, groups)
    return SpringBones(tuple(chains), colliders)


def read_colliders(extension: Any, json: Json) -> tuple[Collider, ...]:
    """Return the colliders of the extension's JSON, all of whose values are checked. json: that of the whole file."""
    animation = _animation(extension)
    _check(animation, len(json_array(json, "nodes")))
    return tuple(
        locate(f"colliderGroups[{i}]", _collider, each, group)
        for i, group in enumerate(animation.get("colliderGroups", []))
        for each in group.get("colliders", [])
    )


def _animation(extension: Any) -> Json:
    animation = extension.get("secondaryAnimation") if isinstance(extension, dict) else None
    return animation if isinstance(animation, dict) else {}


def _nodes_below(root: int, nodes: list[Json], joints: JointSprings, spring: str) -> list[int]:
    """A node and all below it, depth first, as joints of a spring."""
    found, waiting = [], [root]
    while waiting:
        node = waiting.pop()
        joints.add(node, spring)
        found.append(node)
        waiting.extend(reversed(nodes[node].get("children", [])))
    return found


def _chains(group: Json, branches: list[list[int]], nodes: list[Json], groups: list[range]) -> list[SpringChain]:
    """The chains of a group's bones, which share its parameters and its colliders."""
    if not branches:
        return []
    direction, power = _vector(group.get("gravityDir", {"y": -1.0})), group.get("gravityPower", 0.0)
    parameters = SpringParameters(
        stiffness=group.get("stiffiness", DEFAULT_STIFFNESS),
        drag=group.get("dragForce", DEFAULT_DRAG),
        gravity=(power * direction[0], power * direction[1], power * direction[2]),
        hit_radius=group.get("hitRadius", DEFAULT_HIT_RADIUS_M),
    )
    colliders = tuple(index for each in dict.fromkeys(group.get("colliderGroups", [])) for index in groups[each])
    center = group.get("center", -1)
    return [
        SpringChain(
            group.get("comment", "") or nodes[below[0]].get("name", ""),
            _joints(below, nodes, parameters),
            colliders,
            center if center >= 0 else None,
        )
        for below in branches
    ]


def _joints(below: list[int], nodes: list[Json], parameters: SpringParameters) -> tuple[SpringJoint, ...]:
    joints = []
    for node in below:
        children = nodes[node].get("children", [])
        tail = children[0] if children else None
        joints.append(SpringJoint(node, tail, parameters, (0.0, 0.0, 0.0) if children else _last_tail(nodes[node])))
    return tuple(joints)


def _last_tail(node: Json) -> Vector:
    offset = np.array(node.get("translation", (0.0, 0.0, 0.0)), np.float64)
    length = float(np.linalg.norm(offset))
    x, y, z = offset * (LAST_TAIL_M / length) if length else offset
    return float(x), float(y), float(z)


def _collider(collider: Json, group: Json) -> Collider:
    offset = _vector(collider.get("offset", {}))
    return Collider(group["node"], ColliderShape.SPHERE, offset=offset, radius=collider.get("radius", 0.0))


def _vector(value: Json) -> Vector:
    return value.get("x", 0.0), value.get("y", 0.0), -value.get("z", 0.0)


def _check(animation: Json, num_nodes: int) -> None:
    """Raise FormatError, with the position, for a value of a wrong type or an index out of range."""
    node = index("nodes", num_nodes)
    vector = ObjectRule(dict.fromkeys("xyz", number))
    collider = ObjectRule({"offset": vector, "radius": number})
    group = ObjectRule({"node": node, "colliders": list_of(collider)}, ("node",))
    num_groups = count_items(animation, "colliderGroups")
    bones = ObjectRule(
        {
            **dict.fromkeys(("stiffiness", "gravityPower", "dragForce", "hitRadius"), number),
            "center": WholeNumber(-1, num_nodes, f"expected -1 for none, or one of {num_nodes} nodes"),
            "gravityDir": vector,
            "comment": text,
            "bones": list_of(node),
            "colliderGroups": list_of(index("collider groups", num_groups)),
        }
    )
    check_property("colliderGroups", list_of(group), animation.get("colliderGroups", []))
    check_property("boneGroups", list_of(bones), animation.get("boneGroups", []))
