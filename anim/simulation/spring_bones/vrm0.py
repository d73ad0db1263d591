"""secondaryAnimation of VRM 0.x → SpringBones.

Every descendant of a listed bone is a joint, and its first child is the tail; the last joint of a branch gets a tail of
7 cm along its own translation. Positions and directions are those of Unity, whose z axis is opposite to glTF's.
Source: VRM 0.x schema ("stiffiness" is its spelling); For `vrm0` in VRMC_springBone 1.0; UniVRM's defaults.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from anim.gltf.document import Json, json_array
from anim.gltf.validation.rules import ObjectRule, at_least, check_property, index, list_of, number, text
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, SpringParameters
from anim.simulation.spring_bones.colliders import Collider, ColliderShape, Vector
from anim.simulation.spring_bones.json_values import count_items, locate

EXTENSION = "VRM"
DEFAULT_STIFFNESS, DEFAULT_DRAG, DEFAULT_HIT_RADIUS_M = 1.0, 0.4, 0.02  # UniVRM's
LAST_TAIL_M = 0.07  # of the last joint of a branch


def read(extension: Any, json: Json) -> SpringBones:
    """Return the chains and colliders of the extension's JSON. json: that of the whole file."""
    animation = extension.get("secondaryAnimation") if isinstance(extension, dict) else None
    if not isinstance(animation, dict):
        return SpringBones(())
    nodes = json_array(json, "nodes")
    _check(animation, len(nodes))
    groups: list[tuple[int, ...]] = []
    colliders: list[Collider] = []
    for i, group in enumerate(animation.get("colliderGroups", [])):
        first = len(colliders)
        for each in group.get("colliders", []):
            colliders.append(locate(f"colliderGroups[{i}]", _collider, each, group))
        groups.append(tuple(range(first, len(colliders))))
    chains = [
        locate(f"boneGroups[{i}]", _chain, group, root, nodes, groups)
        for i, group in enumerate(animation.get("boneGroups", []))
        for root in group.get("bones", [])
    ]
    return SpringBones(tuple(chains), tuple(colliders))


def _chain(group: Json, root: int, nodes: list[Json], groups: list[tuple[int, ...]]) -> SpringChain:
    direction, power = _vector(group.get("gravityDir", {"y": -1.0})), group.get("gravityPower", 0.0)
    parameters = SpringParameters(
        stiffness=group.get("stiffiness", DEFAULT_STIFFNESS),
        drag=group.get("dragForce", DEFAULT_DRAG),
        gravity=(power * direction[0], power * direction[1], power * direction[2]),
        hit_radius=group.get("hitRadius", DEFAULT_HIT_RADIUS_M),
    )
    joints: list[SpringJoint] = []
    waiting = [root]
    while waiting:
        node = waiting.pop()
        children = nodes[node].get("children", [])
        tail = children[0] if children else None
        joints.append(SpringJoint(node, tail, parameters, (0.0, 0.0, 0.0) if children else _last_tail(nodes[node])))
        waiting.extend(reversed(children))
    colliders = dict.fromkeys(index for each in group.get("colliderGroups", []) for index in groups[each])
    center = group.get("center", -1)
    name = group.get("comment", "") or nodes[root].get("name", "")
    return SpringChain(name, tuple(joints), tuple(colliders), center if center >= 0 else None)


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
            "center": at_least(-1),
            "gravityDir": vector,
            "comment": text,
            "bones": list_of(node),
            "colliderGroups": list_of(index("collider groups", num_groups)),
        }
    )
    check_property("colliderGroups", list_of(group), animation.get("colliderGroups", []))
    check_property("boneGroups", list_of(bones), animation.get("boneGroups", []))
