"""Validate the JSON by glTF's schema once on reading, so that later code needs no checks.

Only properties used by animation, skinning and buffers are checked, and only ambiguous faults: an empty array, a wrong
min/max or an unknown property is harmless and left to `inspect`'s findings.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

from anim.errors import FormatError
from anim.gltf.document import Json
from anim.gltf.validation import buffer_layout, channel_targets, hierarchy
from anim.gltf.validation.rules import (
    Check,
    ObjectRule,
    at_least,
    boolean,
    check_items,
    check_property,
    index,
    list_of,
    map_of,
    numbers,
    of_type,
    one_of,
    text,
)

Counts: TypeAlias = Mapping[str, int]  # count of each kind of object
ANYTHING = ObjectRule({})  # an object with any content
TOP_ARRAYS = frozenset(
    """
    accessors animations buffers bufferViews cameras images materials meshes nodes samplers scenes skins textures
    """.split()  # noqa: SIM905 (a list of one name per line would hide the words)
)


def validate(json: Json) -> None:
    """Raise FormatError, with a JSON path, at the first violation of glTF 2.0."""
    for key in TOP_ARRAYS:
        of_type(json.get(key, []), list, "an array", key)
    counts = {key: len(json.get(key, [])) for key in TOP_ARRAYS}
    checks = rules(counts)
    if "asset" not in json:
        raise FormatError("has no 'asset' (every glTF names its version there)")
    check_property("asset", checks.pop("asset"), json["asset"])
    if "scene" in json:
        check_property("scene", _index("scenes", counts), json["scene"])
    for key in ("extensionsUsed", "extensionsRequired"):
        check_property(key, list_of(text), json.get(key, []))
    for key, check_one in checks.items():
        check_items(json.get(key, []), check_one, key)
    buffer_layout.check(json)
    hierarchy.check(json)
    channel_targets.check(json)


def rules(counts: Counts) -> dict[str, Check]:
    """Return the check of each kind of object by its array's name, and of "asset"."""
    return {
        "asset": ObjectRule({"version": _version, "minVersion": _min_version}, ("version",)),
        "accessors": _accessor(counts),
        "animations": _animation(counts),
        "buffers": ObjectRule({"byteLength": at_least(1), "uri": text, "extensions": ANYTHING}, ("byteLength",)),
        "bufferViews": _view(counts),
        "images": ObjectRule({"uri": text, "bufferView": _index("bufferViews", counts)}),
        "meshes": _mesh(counts),
        "nodes": _node(counts),
        "scenes": ObjectRule({"nodes": list_of(_index("nodes", counts))}),
        "skins": _skin(counts),
    }


def _accessor(counts: Counts) -> ObjectRule:
    view = _index("bufferViews", counts)
    indices: dict[str, Check] = {
        "bufferView": view,
        "byteOffset": at_least(0),
        "componentType": one_of(5121, 5123, 5125),
    }
    sparse: dict[str, Check] = {
        "count": at_least(1),
        "indices": ObjectRule(indices, ("bufferView", "componentType")),
        "values": ObjectRule({"bufferView": view, "byteOffset": at_least(0)}, ("bufferView",)),
    }
    properties: dict[str, Check] = {
        "bufferView": view,
        "byteOffset": at_least(0),
        "componentType": one_of(*buffer_layout.COMPONENT_SIZES),
        "count": at_least(1),
        "type": text,
        "normalized": boolean,
        "sparse": ObjectRule(sparse, ("count", "indices", "values")),
    }
    return ObjectRule(properties, ("componentType", "count", "type"))


def _view(counts: Counts) -> ObjectRule:
    properties: dict[str, Check] = {
        "buffer": _index("buffers", counts),
        "byteOffset": at_least(0),
        "byteLength": at_least(1),
        "byteStride": at_least(1),
        "extensions": ANYTHING,
    }
    return ObjectRule(properties, ("buffer", "byteLength"))


def _animation(counts: Counts) -> ObjectRule:
    accessor = _index("accessors", counts)
    target = ObjectRule({"node": _index("nodes", counts), "path": text, "extensions": ANYTHING}, ("path",))
    channel = ObjectRule({"sampler": at_least(0), "target": target}, ("sampler", "target"))
    sampler = ObjectRule({"input": accessor, "output": accessor, "interpolation": text}, ("input", "output"))
    properties: dict[str, Check] = {"channels": list_of(channel), "samplers": list_of(sampler), "name": text}
    return ObjectRule(properties, ("channels", "samplers"), _check_channels)


def _mesh(counts: Counts) -> ObjectRule:
    attributes = map_of(_index("accessors", counts))
    primitive: dict[str, Check] = {
        "attributes": attributes,
        "indices": _index("accessors", counts),
        "targets": list_of(attributes),
        "mode": at_least(0),
        "extensions": ANYTHING,
    }
    properties: dict[str, Check] = {
        "primitives": list_of(ObjectRule(primitive, ("attributes",))),
        "weights": numbers(None),
        "name": text,
    }
    return ObjectRule(properties, ("primitives",), _check_mesh)


def _node(counts: Counts) -> ObjectRule:
    properties: dict[str, Check] = {
        "children": list_of(_index("nodes", counts)),
        "matrix": numbers(16),
        "translation": numbers(3),
        "rotation": numbers(4),
        "scale": numbers(3),
        "weights": numbers(None),
        "mesh": _index("meshes", counts),
        "skin": _index("skins", counts),
        "name": text,
        "extensions": ANYTHING,
    }
    return ObjectRule(properties, whole=_check_node)


def _skin(counts: Counts) -> ObjectRule:
    properties: dict[str, Check] = {
        "joints": list_of(_index("nodes", counts)),
        "inverseBindMatrices": _index("accessors", counts),
        "skeleton": _index("nodes", counts),
        "name": text,
    }
    return ObjectRule(properties, ("joints",), _check_skin)


def _index(of: str, counts: Counts) -> Check:
    return index(of, counts[of])


def _version(value: Any) -> None:
    text(value)
    if value.split(".")[0] != "2":
        raise FormatError(f"is '{value}' (expected 2.x)")


def _min_version(value: Any) -> None:
    text(value)
    if value != "2.0":
        raise FormatError(f"is '{value}' (expected 2.0, the version that is read)")


def _check_channels(animation: Json) -> None:
    samplers = len(animation["samplers"])
    for i, channel in enumerate(animation["channels"]):
        if channel["sampler"] >= samplers:
            raise FormatError(
                f"is {channel['sampler']} (the animation has {samplers} samplers)", where=f"channels[{i}].sampler"
            )


def _check_node(node: Json) -> None:
    if "matrix" in node and any(key in node for key in ("translation", "rotation", "scale")):
        raise FormatError("has both a matrix and translation, rotation or scale")


def _check_mesh(mesh: Json) -> None:
    counts = {len(primitive.get("targets", ())) for primitive in mesh["primitives"]}
    if len(counts) > 1:
        raise FormatError(f"primitives have different numbers of morph targets ({sorted(counts)})")
    targets_there = max(counts, default=0)
    if len(mesh.get("weights", ())) not in (0, targets_there):
        raise FormatError(f"has {len(mesh['weights'])} weights for {targets_there} morph targets")


def _check_skin(skin: Json) -> None:
    if not skin["joints"]:
        raise FormatError("has no joints")
