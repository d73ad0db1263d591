"""Spring bones in a JSON file of their own.

    {
      "schema": "spring-bones/1",
      "colliders": [
        {"name": "head", "node": "Head", "sphere": {"offset": [0, 0.1, 0], "radius": 0.12}},
        {"name": "floor", "plane": {"normal": [0, 1, 0]}}                  without a node: fixed in the scene
      ],
      "chains": [
        {
          "root": "Tail*",                                                  a glob, or "joints": ["Tail1", "Tail2", …]
          "stiffness": 1, "drag": 0.5, "gravity": 0.2, "hit_radius": 0.02,  gravity downwards, or a vector
          "frequency": 2, "damping_ratio": 0.3,                             in place of stiffness and drag
          "center": "Hips",
          "colliders": ["head"]                                             all of them without this
        }
      ]
    }

Shapes are sphere, capsule (offset, tail, radius) and plane (offset, normal), as in VRMC_springBone; "inside": true
keeps joints inside a sphere or capsule. Other keys are errors.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from typing import Any

from anim.errors import FormatError
from anim.gltf.document import Json
from anim.gltf.io import json_text
from anim.gltf.validation.rules import Check, ObjectRule, check_property, list_of, number, numbers, text
from anim.model import Skeleton
from anim.operations.selection import match_names
from anim.simulation.spring_bones.chain_globs import find_chains
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, SpringParameters
from anim.simulation.spring_bones.colliders import Collider
from anim.simulation.spring_bones.json_values import EXTENDED_SHAPES, locate, one_of_shapes, parse_shape

SCHEMA = "spring-bones/1"
QUANTITIES = ("stiffness", "drag", "hit_radius", "frequency", "damping_ratio")


def read_spring_file(
    data: bytes, skeleton: Skeleton, *, skin_joints: Collection[int] = (), has_chains: bool = True
) -> SpringBones:
    """Return the chains and colliders of a JSON file, for the nodes of `skeleton`.

    skin_joints: as of `find_chains`. has_chains: False for a file that may have colliders only.
    Raises FormatError with the position for anything unknown or invalid, and NotFoundError for a node that the skeleton
    lacks.
    """
    content = json_text.parse(json_text.skip_mark(data))
    _check(content, has_chains=has_chains)
    colliders = [
        locate(f"colliders[{i}]", _collider, each, skeleton) for i, each in enumerate(content.get("colliders", []))
    ]
    chains = [
        chain
        for i, each in enumerate(content.get("chains", []))
        for chain in locate(f"chains[{i}]", _chains, each, skeleton, colliders, skin_joints)
    ]
    return SpringBones(tuple(chains), tuple(colliders))


def _collider(value: Json, skeleton: Skeleton) -> Collider:
    node = _node(skeleton, value["node"]) if "node" in value else None
    return parse_shape(value, node, value.get("name", ""))


def _chains(
    value: Json, skeleton: Skeleton, colliders: Sequence[Collider], skin_joints: Collection[int]
) -> tuple[SpringChain, ...]:
    parameters = _parameters(value)
    center = _node(skeleton, value["center"]) if "center" in value else None
    known = [each.name or f"#{i}" for i, each in enumerate(colliders)]
    chosen = list(range(len(colliders)))
    if "colliders" in value:
        chosen = [i for name in value["colliders"] for i in match_names([name], known, "collider")]
    if "root" in value:
        chains = find_chains(
            skeleton, [value["root"]], parameters, skin_joints=skin_joints, colliders=tuple(chosen), center=center
        )
        return tuple(
            SpringChain(value.get("name", each.name), each.joints, each.colliders, each.center) for each in chains
        )
    nodes = [_node(skeleton, name) for name in value["joints"]]
    joints = tuple(SpringJoint(one, other, parameters) for one, other in pairwise(nodes))
    return (SpringChain(value.get("name", ""), joints, tuple(chosen), center),)


def _parameters(value: Json) -> SpringParameters:
    gravity = value.get("gravity", 0.0)
    vector = (0.0, -float(gravity), 0.0) if isinstance(gravity, int | float) else gravity
    return SpringParameters(gravity=vector, **{key: value[key] for key in QUANTITIES if key in value})


def _node(skeleton: Skeleton, glob: str) -> int:
    found = match_names([glob], [name or f"#{i}" for i, name in enumerate(skeleton.names)], "node")
    if len(found) > 1:
        raise FormatError(f"'{glob}' matches {len(found)} nodes (expected one)")
    return found[0]


def _check(content: Json, *, has_chains: bool) -> None:
    """Raise FormatError, with the position, for an unknown key or a value of a wrong type."""
    chain: dict[str, Check] = {
        "name": text,
        "root": text,
        "joints": list_of(text),
        "gravity": _gravity,
        "center": text,
        "colliders": list_of(text),
        **dict.fromkeys(QUANTITIES, number),
    }
    collider: dict[str, Check] = {"name": text, "node": text, **EXTENDED_SHAPES}
    _known(content, ("schema", "colliders", "chains"))
    if content.get("schema") != SCHEMA:
        raise FormatError(f"schema is {content.get('schema')!r} (expected '{SCHEMA}')")
    if has_chains and not content.get("chains"):
        raise FormatError("has no chains")
    check_property(
        "colliders", list_of(_strict(collider, one_of_shapes(EXTENDED_SHAPES))), content.get("colliders", [])
    )
    check_property("chains", list_of(_strict(chain, _start)), content.get("chains", []))


def _strict(properties: Mapping[str, Check], whole: Check) -> ObjectRule:
    def check(value: Any) -> None:
        _known(value, properties)
        whole(value)

    return ObjectRule(properties, whole=check)


def _known(value: Json, keys: Collection[str]) -> None:
    for key in value:
        if key not in keys:
            near = difflib.get_close_matches(key, keys, n=1)
            raise FormatError(f"unknown key '{key}'", help=f"did you mean '{near[0]}'?" if near else "")


def _start(chain: Json) -> None:
    if ("root" in chain) is ("joints" in chain):
        raise FormatError("has both root and joints" if "root" in chain else "has neither root nor joints")
    if "joints" in chain and len(chain["joints"]) < 2:
        raise FormatError("has fewer than two joints (the last one is only the tail of the one before)")


def _gravity(value: Any) -> None:
    (numbers(3) if isinstance(value, list) else number)(value)
