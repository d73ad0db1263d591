"""Is the JSON what glTF's schema says? Checked once at the door, so that nothing behind it meets a missing key.

Only what animation, skinning and buffers rest on is checked, and only faults that leave no single meaning: an empty
array, a wrong min/max or an unknown property does no harm and is left to `inspect`'s findings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from anim.errors import FormatError
from anim.gltf import hierarchy, layout, targets
from anim.gltf.document import Json

Check = Callable[[Any], None]
LARGEST = 3.4e38  # what float32 holds

TOP_ARRAYS = frozenset(
    """
    accessors animations buffers bufferViews cameras images materials meshes nodes samplers scenes skins textures
    """.split()  # noqa: SIM905 (a list of one name per line would hide the words)
)


@dataclass(frozen=True, slots=True)
class Rule:
    """What an object must look like: a check per property, what must be there, and a check of the whole."""

    properties: Mapping[str, Check]
    required: tuple[str, ...] = ()
    whole: Check | None = None

    def __call__(self, value: Any) -> None:
        if type(value) is not dict:
            raise FormatError(f"is {_name(value)} (expected an object)")
        for key in self.required:
            if key not in value:
                raise FormatError(f"has no '{key}'")
        properties = self.properties
        for key, item in value.items():
            check = properties.get(key)
            if check is not None:
                try:
                    check(item)
                except FormatError as error:
                    raise error.at(key, _joint(error)) from None
        if self.whole is not None:
            self.whole(value)


def check(json: Json) -> None:
    """Raise FormatError, with the place as a path into the JSON, at the first thing that is not glTF 2.0."""
    for key in TOP_ARRAYS:
        _check_type(json.get(key, []), list, "an array", key)
    counts = {key: len(json.get(key, [])) for key in TOP_ARRAYS}
    rules = _rules(counts)
    if "asset" not in json:
        raise FormatError("has no 'asset' (every glTF names its version there)")
    _named("asset", rules.pop("asset"), json["asset"])
    for key in ("extensionsUsed", "extensionsRequired"):
        _named(key, _list_of(_text), json.get(key, []))
    for key, rule in rules.items():
        _check_each(json.get(key, []), rule, key)
    layout.check(json)
    hierarchy.check(json)
    targets.check(json)


def _rules(counts: Mapping[str, int]) -> dict[str, Check]:
    def index(of: str) -> Check:
        return _index(of, counts[of])

    sparse = Rule(
        {
            "count": _whole(1),
            "indices": Rule(
                {
                    "bufferView": index("bufferViews"),
                    "byteOffset": _whole(0),
                    "componentType": _one_of(5121, 5123, 5125),
                },
                ("bufferView", "componentType"),
            ),
            "values": Rule({"bufferView": index("bufferViews"), "byteOffset": _whole(0)}, ("bufferView",)),
        },
        ("count", "indices", "values"),
    )
    accessor = Rule(
        {
            "bufferView": index("bufferViews"),
            "byteOffset": _whole(0),
            "componentType": _one_of(*layout.COMPONENT_SIZES),
            "count": _whole(1),
            "type": _text,
            "normalized": _bool,
            "sparse": sparse,
        },
        ("componentType", "count", "type"),
    )
    view = Rule(
        {
            "buffer": index("buffers"),
            "byteOffset": _whole(0),
            "byteLength": _whole(1),
            "byteStride": _whole(1),
            "extensions": Rule({}),
        },
        ("buffer", "byteLength"),
    )
    target = Rule({"node": index("nodes"), "path": _text, "extensions": Rule({})}, ("path",))
    sampler = Rule(
        {"input": index("accessors"), "output": index("accessors"), "interpolation": _text}, ("input", "output")
    )
    animation = Rule(
        {"channels": _list_of(Rule({"sampler": _whole(0), "target": target}, ("sampler", "target"))),
         "samplers": _list_of(sampler), "name": _text},
        ("channels", "samplers"), _check_channels,
    )  # fmt: skip
    attributes = _map_of(index("accessors"))
    primitive = Rule(
        {
            "attributes": attributes,
            "indices": index("accessors"),
            "targets": _list_of(attributes),
            "mode": _whole(0),
            "extensions": Rule({}),
        },
        ("attributes",),
    )
    node = Rule(
        {
            "children": _list_of(index("nodes")),
            "matrix": _numbers(16),
            "translation": _numbers(3),
            "rotation": _numbers(4),
            "scale": _numbers(3),
            "weights": _numbers(None),
            "mesh": index("meshes"),
            "skin": index("skins"),
            "name": _text,
            "extensions": Rule({}),
        },
        (),
        _check_node,
    )
    return {
        "asset": Rule({"version": _version, "minVersion": _text}, ("version",)),
        "accessors": accessor,
        "animations": animation,
        "buffers": Rule({"byteLength": _whole(1), "uri": _text, "extensions": Rule({})}, ("byteLength",)),
        "bufferViews": view,
        "images": Rule({"uri": _text, "bufferView": index("bufferViews")}),
        "meshes": Rule(
            {"primitives": _list_of(primitive), "weights": _numbers(None), "name": _text}, ("primitives",), _check_mesh
        ),
        "nodes": node,
        "scenes": Rule({"nodes": _list_of(index("nodes"))}),
        "skins": Rule(
            {
                "joints": _list_of(index("nodes")),
                "inverseBindMatrices": index("accessors"),
                "skeleton": index("nodes"),
                "name": _text,
            },
            ("joints",),
            _check_skin,
        ),
    }


def _named(key: str, rule: Check, value: Any) -> None:
    try:
        rule(value)
    except FormatError as error:
        raise error.at(key, _joint(error)) from None


def _check_each(values: list[Any], rule: Check, key: str) -> None:
    i = 0
    try:
        for i, value in enumerate(values):  # noqa: B007 (i is read after the loop broke)
            rule(value)
    except FormatError as error:
        raise error.at(f"{key}[{i}]", _joint(error)) from None


def _joint(error: FormatError) -> str:
    return "" if error.where.startswith("[") else "." if error.where else ""


def _list_of(rule: Check) -> Check:
    def check_list(value: Any) -> None:
        _check_type(value, list, "an array")
        _check_each(value, rule, "")

    return check_list


def _map_of(rule: Check) -> Check:
    def check_map(value: Any) -> None:
        _check_type(value, dict, "an object")
        for key, item in value.items():
            _named(key, rule, item)

    return check_map


def _index(of: str, count: int) -> Check:
    def check_index(value: Any) -> None:
        if type(value) is not int or not 0 <= value < count:
            _check_type(value, int, "a whole number")
            raise FormatError(f"is {value} (the file has {count} {of})")

    return check_index


def _whole(least: int) -> Check:
    def check_whole(value: Any) -> None:
        if type(value) is not int or value < least:
            _check_type(value, int, "a whole number")
            raise FormatError(f"is {value} (expected {least} or more)")

    return check_whole


def _one_of(*allowed: int) -> Check:
    def check_one(value: Any) -> None:
        if type(value) is not int or value not in allowed:
            raise FormatError(f"is {_name(value)} (expected one of {', '.join(map(str, allowed))})")

    return check_one


def _numbers(count: int | None) -> Check:
    def check_numbers(value: Any) -> None:
        _check_type(value, list, "an array")
        if count is not None and len(value) != count:
            raise FormatError(f"has {len(value)} numbers (expected {count})")
        for item in value:
            if (type(item) is not float and type(item) is not int) or not -LARGEST < item < LARGEST:
                raise FormatError(f"holds {_name(item)} (expected finite numbers)")

    return check_numbers


def _text(value: Any) -> None:
    if type(value) is not str:
        _check_type(value, str, "a string")


def _bool(value: Any) -> None:
    _check_type(value, bool, "true or false")


def _version(value: Any) -> None:
    _text(value)
    if value.split(".")[0] != "2":
        raise FormatError(f"is '{value}' (expected 2.x)")


def _check_type(value: Any, kind: type, words: str, where: str = "") -> None:
    if type(value) is not kind:
        raise FormatError(f"is {_name(value)} (expected {words})", where=where)


def _name(value: Any) -> str:
    words = {dict: "an object", list: "an array", str: "a string", bool: "a boolean", type(None): "null"}
    return words.get(type(value), repr(value)[:60])


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
