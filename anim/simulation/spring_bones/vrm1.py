"""VRMC_springBone 1.0, with VRMC_springBone_extended_collider, → SpringBones.

Source: the extensions' specifications and JSON schemas, which state the defaults.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from anim.gltf.document import Json, json_array
from anim.gltf.validation.rules import ObjectRule, check_property, index, list_of, number, numbers, of_type, text
from anim.simulation.spring_bones.chains import (
    DEFAULT_DRAG,
    DEFAULT_STIFFNESS,
    DOWN,
    SpringBones,
    SpringChain,
    SpringJoint,
    SpringParameters,
)
from anim.simulation.spring_bones.colliders import Collider
from anim.simulation.spring_bones.json_values import (
    EXTENDED_SHAPES,
    PLAIN_SHAPES,
    count_items,
    locate,
    one_of_shapes,
    parse_shape,
)

EXTENSION = "VRMC_springBone"
EXTENDED = "VRMC_springBone_extended_collider"
LIMIT = "VRMC_springBone_limit"
VERSIONS = ("1.0", "1.0-draft")  # of the extended colliders; another version falls back to the plain shape


def read(extension: Any, json: Json) -> SpringBones:
    """Return the chains and colliders of the extension's JSON. json: that of the whole file."""
    nodes = index("nodes", len(json_array(json, "nodes")))
    _check(extension, nodes)
    colliders = tuple(
        locate(f"colliders[{i}]", _collider, each) for i, each in enumerate(extension.get("colliders", []))
    )
    groups = [tuple(group["colliders"]) for group in extension.get("colliderGroups", [])]
    chains = tuple(
        locate(f"springs[{i}]", _chain, each, groups)
        for i, each in enumerate(extension.get("springs", []))
        if len(each["joints"]) > 1
    )
    return SpringBones(chains, colliders, tuple(_notes(extension)))


def _chain(spring: Json, groups: list[tuple[int, ...]]) -> SpringChain:
    joints = tuple(
        SpringJoint(one["node"], other["node"], locate(f"joints[{i}]", _parameters, one))
        for i, (one, other) in enumerate(pairwise(spring["joints"]))
    )
    colliders = dict.fromkeys(index for group in spring.get("colliderGroups", []) for index in groups[group])
    return SpringChain(spring.get("name", ""), joints, tuple(colliders), spring.get("center"))


def _parameters(joint: Json) -> SpringParameters:
    power, direction = joint.get("gravityPower", 0.0), joint.get("gravityDir", DOWN)
    return SpringParameters(
        stiffness=joint.get("stiffness", DEFAULT_STIFFNESS),
        drag=joint.get("dragForce", DEFAULT_DRAG),
        gravity=(power * direction[0], power * direction[1], power * direction[2]),
        hit_radius=joint.get("hitRadius", 0.0),
    )


def _collider(collider: Json) -> Collider:
    extended = collider.get("extensions", {}).get(EXTENDED, {})
    shape = extended.get("shape") if extended.get("specVersion") in VERSIONS else None
    return parse_shape(shape or collider["shape"], collider["node"])


def _notes(extension: Json) -> Iterator[str]:
    joints = (joint for spring in extension.get("springs", []) for joint in spring["joints"])
    if any(LIMIT in joint.get("extensions", {}) for joint in joints):
        yield f"angle limits ({LIMIT}) are not evaluated"
    versions = {
        found["specVersion"]
        for each in extension.get("colliders", [])
        if (found := each.get("extensions", {}).get(EXTENDED)) and found["specVersion"] not in VERSIONS
    }
    for version in sorted(versions):
        yield f"{EXTENDED} {version} is unknown: the plain shapes of its colliders are used"


def _check(extension: Any, node: Any) -> None:
    """Raise FormatError, with the position, for a value that the schema does not allow."""
    of_type(extension, dict, "an object")
    colliders = list_of(index("colliders", count_items(extension, "colliders")))
    groups = list_of(index("collider groups", count_items(extension, "colliderGroups")))
    properties = {
        "colliders": list_of(_collider_rule(node)),
        "colliderGroups": list_of(ObjectRule({"name": text, "colliders": colliders}, ("colliders",))),
        "springs": list_of(_spring_rule(node, groups)),
    }
    for key, rule in properties.items():
        check_property(key, rule, extension.get(key, []))


def _spring_rule(node: Any, groups: Any) -> ObjectRule:
    joint = ObjectRule(
        {
            "node": node,
            **dict.fromkeys(("stiffness", "dragForce", "gravityPower", "hitRadius"), number),
            "gravityDir": numbers(3),
            "extensions": ObjectRule({}),
        },
        ("node",),
    )
    return ObjectRule({"name": text, "joints": list_of(joint), "colliderGroups": groups, "center": node}, ("joints",))


def _collider_rule(node: Any) -> ObjectRule:
    extension = ObjectRule({"specVersion": text, "shape": one_of_shapes(EXTENDED_SHAPES)}, ("specVersion",))
    properties = {
        "node": node,
        "shape": one_of_shapes(PLAIN_SHAPES),
        "extensions": ObjectRule({EXTENDED: extension}),
    }
    return ObjectRule(properties, ("node", "shape"))
