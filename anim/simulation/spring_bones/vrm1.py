"""VRMC_springBone 1.0, with VRMC_springBone_extended_collider and VRMC_springBone_limit, → SpringBones.

Source: the extensions' specifications and JSON schemas, which state the defaults.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from anim.gltf.document import Json, json_array
from anim.gltf.validation.rules import Check, ObjectRule, check_property, index, list_of, number, numbers, of_type, text
from anim.simulation.spring_bones.angle_limits import IDENTITY, AngleLimit, LimitShape
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
    JointSprings,
    count_items,
    locate,
    one_of_shapes,
    parse_shape,
)

EXTENSION = "VRMC_springBone"
EXTENDED = "VRMC_springBone_extended_collider"
LIMIT = "VRMC_springBone_limit"
VERSIONS = ("1.0", "1.0-draft")  # of both; another version is left out: plain shapes, no limits
_ANGLE = ObjectRule({"angle": number, "rotation": numbers(4)}, ("angle",))
_PITCH_YAW = ObjectRule({"pitch": number, "yaw": number, "rotation": numbers(4)}, ("pitch", "yaw"))
LIMIT_SHAPES: dict[str, Check] = {"cone": _ANGLE, "hinge": _ANGLE, "spherical": _PITCH_YAW}


def read(extension: Any, json: Json) -> SpringBones:
    """Return the chains and colliders of the extension's JSON. json: that of the whole file."""
    colliders = read_colliders(extension, json)
    groups = [tuple(dict.fromkeys(group["colliders"])) for group in extension.get("colliderGroups", [])]
    springs = [(f"springs[{i}]", each) for i, each in enumerate(extension.get("springs", []))]
    joints = JointSprings(json_array(json, "nodes"))
    for where, spring in springs:
        for joint in spring["joints"][:-1]:  # the last one is only a tail
            joints.add(joint["node"], where)
    chains = [locate(where, _chain, each, groups) for where, each in springs if len(each["joints"]) > 1]
    return SpringBones(tuple(chains), colliders, tuple(_notes(extension)))


def read_colliders(extension: Any, json: Json) -> tuple[Collider, ...]:
    """Return the colliders of the extension's JSON, all of whose values are checked. json: that of the whole file."""
    _check(extension, index("nodes", len(json_array(json, "nodes"))))
    return tuple(locate(f"colliders[{i}]", _collider, each) for i, each in enumerate(extension.get("colliders", [])))


def _chain(spring: Json, groups: list[tuple[int, ...]]) -> SpringChain:
    joints = tuple(
        SpringJoint(
            one["node"],
            other["node"],
            locate(f"joints[{i}]", _parameters, one),
            limit=locate(f"joints[{i}].extensions.{LIMIT}.limit", _limit, one),
        )
        for i, (one, other) in enumerate(pairwise(spring["joints"]))
    )
    own = dict.fromkeys(spring.get("colliderGroups", []))
    colliders = dict.fromkeys(index for group in own for index in groups[group])
    return SpringChain(spring.get("name", ""), joints, tuple(colliders), spring.get("center"))


def _parameters(joint: Json) -> SpringParameters:
    power, direction = float(joint.get("gravityPower", 0.0)), joint.get("gravityDir", DOWN)  # integers don't overflow
    return SpringParameters(
        stiffness=joint.get("stiffness", DEFAULT_STIFFNESS),
        drag=joint.get("dragForce", DEFAULT_DRAG),
        gravity=(power * direction[0], power * direction[1], power * direction[2]),
        hit_radius=joint.get("hitRadius", 0.0),
    )


def _limit(joint: Json) -> AngleLimit | None:
    extension = joint.get("extensions", {}).get(LIMIT, {})
    if extension.get("specVersion") not in VERSIONS:
        return None
    kind, about = next((kind, extension["limit"][kind]) for kind in LIMIT_SHAPES if kind in extension["limit"])
    angle = about["pitch" if kind == "spherical" else "angle"]
    rotation = about.get("rotation", IDENTITY)
    return AngleLimit(LimitShape(kind), angle, about.get("yaw", 0.0), tuple(rotation))


def _collider(collider: Json) -> Collider:
    extended = collider.get("extensions", {}).get(EXTENDED, {})
    shape = extended.get("shape") if extended.get("specVersion") in VERSIONS else None
    return parse_shape(shape or collider["shape"], collider["node"])


def _notes(extension: Json) -> Iterator[str]:
    joints = [joint for spring in extension.get("springs", []) for joint in spring["joints"][:-1]]
    for version in _unknown_versions(joints, LIMIT):
        yield f"{LIMIT} {version} is unknown: its angle limits are not applied"
    for version in _unknown_versions(extension.get("colliders", []), EXTENDED):
        yield f"{EXTENDED} {version} is unknown: the plain shapes of its colliders are used"


def _unknown_versions(objects: list[Json], name: str) -> list[str]:
    found = {each["extensions"][name]["specVersion"] for each in objects if name in each.get("extensions", {})}
    return sorted(found - set(VERSIONS))


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
            "extensions": ObjectRule({LIMIT: _limit_rule}),
        },
        ("node",),
    )
    return ObjectRule({"name": text, "joints": list_of(joint), "colliderGroups": groups, "center": node}, ("joints",))


def _limit_rule(value: Any) -> None:
    """Check the extension of a joint; of other versions only that they have one."""
    ObjectRule({"specVersion": text}, ("specVersion",))(value)
    if value["specVersion"] in VERSIONS:
        ObjectRule({"limit": one_of_shapes(LIMIT_SHAPES)}, ("limit",))(value)


def _collider_rule(node: Any) -> ObjectRule:
    extension = ObjectRule({"specVersion": text, "shape": one_of_shapes(EXTENDED_SHAPES)}, ("specVersion",))
    properties = {
        "node": node,
        "shape": one_of_shapes(PLAIN_SHAPES),
        "extensions": ObjectRule({EXTENDED: extension}),
    }
    return ObjectRule(properties, ("node", "shape"))
