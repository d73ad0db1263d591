"""Valid parts of an invalid glTF file, for read-only commands."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from anim.errors import AnimError, FormatError, UnsupportedError
from anim.gltf.document import Json, json_array
from anim.gltf.validation import schema
from anim.gltf.writing.references import views_of

MAX_FAULTS = 32  # each fault needs a check of the whole file
JSON_POINTER = re.compile(r"(\w+)(?:\[(\d+)\])?\.?(\w*)(?:\[(\d+)\])?")
STUB: Json = {"componentType": 5121, "count": 1, "type": "SCALAR"}


@dataclass(frozen=True, slots=True)
class Salvage:
    """json: the valid parts, with the original indices. faults: errors in the rest.

    lost_clips, lost_skins: indices of those that cannot be read at all.
    """

    json: Json
    faults: tuple[AnimError, ...]
    lost_clips: frozenset[int]
    lost_skins: frozenset[int]


def salvage(json: Json) -> Salvage:
    """Return the parts of the JSON that pass `schema.validate`, without those that depend on faulty parts."""
    left = _Remaining(json)
    for _ in range(MAX_FAULTS):
        try:
            schema.validate(left.json)
            break
        except (FormatError, UnsupportedError) as error:
            left.faults.append(error)
            left.remove(error.where)
    else:
        left.json = {"asset": left.json["asset"]}
        left.faults.append(FormatError("and more faults; nothing else was looked at"))
    return Salvage(left.json, tuple(left.faults), frozenset(left.clips), frozenset(left.skins))


class _Remaining:
    """Remaining JSON, reduced by each fault."""

    def __init__(self, json: Json) -> None:
        self.json = dict(json)
        self.faults: list[AnimError] = []
        self.clips: set[int] = set()
        self.skins: set[int] = set()
        self._by_kind: dict[str, Callable[[int, str, int | None], None]] = {
            "accessors": lambda i, key, k: self._accessor(i),
            "animations": self._animation,
            "buffers": lambda i, key, k: self._buffer(i),
            "bufferViews": lambda i, key, k: self._view(i),
            "meshes": lambda i, key, k: self._put("meshes", i, {"primitives": []}),
            "nodes": lambda i, key, k: self._node(i, key),
            "skins": lambda i, key, k: self._skin(i, key),
        }

    def remove(self, where: str) -> None:
        """Remove the part with a fault."""
        match = JSON_POINTER.match(where)
        kind, number, key, inner = match.groups() if match else ("asset", None, "", None)
        if kind == "asset":
            self.json = {k: v for k, v in self.json.items() if k not in schema.TOP_ARRAYS or type(v) is list}
            self.json["asset"] = {"version": "2.0"}
        elif number is None:
            self._whole(kind)
        elif kind in self._by_kind:
            self._by_kind[kind](int(number), key, None if inner is None else int(inner))
        else:
            self._put(kind, int(number), {})

    def _whole(self, kind: str) -> None:
        """Remove a value that is not an array, and everything that depends on it."""
        self.json.pop(kind, None)
        if kind == "buffers":
            self._whole("bufferViews")
        elif kind == "bufferViews":
            for i, accessor in enumerate(_objects(self.json, "accessors")):
                if any(view is not None for view in _views_named(accessor)):
                    self._accessor(i)
        elif kind == "accessors":
            self.json.pop("meshes", None)
            for name, key in (("nodes", "mesh"), ("skins", "inverseBindMatrices")):
                if type(items := self.json.get(name, [])) is list:
                    self.json[name] = [_drop_items(item, key) for item in items]
            for i in range(len(_objects(self.json, "animations"))):
                self._animation(i, "", None)

    def _put(self, kind: str, number: int, value: Json) -> None:
        self.json[kind] = [value if i == number else old for i, old in enumerate(self.json[kind])]

    def _lose(self, kind: str, key: str, number: int, lose: Callable[[int], None]) -> None:
        """Remove every object of a kind that refers to index `number` by this property."""
        for i, each in enumerate(_objects(self.json, kind)):
            if each.get(key) == number:
                lose(i)

    def _buffer(self, number: int) -> None:
        self._put("buffers", number, {"byteLength": 1})
        self._lose("bufferViews", "buffer", number, self._view)

    def _view(self, number: int) -> None:
        self._put("bufferViews", number, {"buffer": 0, "byteLength": 1})
        if not self.json.get("buffers"):
            self.json["buffers"] = [{"byteLength": 1}]
        for i, accessor in enumerate(_objects(self.json, "accessors")):
            if number in _views_named(accessor):
                self._accessor(i)

    def _accessor(self, number: int) -> None:
        self._put("accessors", number, STUB)
        for i, animation in enumerate(_objects(self.json, "animations")):
            samplers = _list(animation, "samplers")
            if any(number in (each.get("input"), each.get("output")) for each in samplers):
                self._animation(i, "", None)
        for i, mesh in enumerate(_objects(self.json, "meshes")):
            if number in _accessors_of(mesh):
                self._put("meshes", i, {"primitives": []})
        self._lose("skins", "inverseBindMatrices", number, lambda i: self._skin(i, "inverseBindMatrices"))

    def _animation(self, number: int, key: str, channel: int | None) -> None:
        old = self.json["animations"][number]
        name = old.get("name") if type(old) is dict else None
        if key == "channels" and channel is not None and len(old["channels"]) > 1:
            idle = {"sampler": 0, "target": {"path": "unreadable"}}  # ignored by readers, as glTF requires
            channels = [idle if k == channel else each for k, each in enumerate(old["channels"])]
            self._put("animations", number, {**old, "channels": channels})
            return
        self.clips.add(number)
        named = {"name": name} if type(name) is str else {}
        self._put("animations", number, {**named, "channels": [], "samplers": []})

    def _node(self, number: int, key: str) -> None:
        node = self.json["nodes"][number]
        if type(node) is not dict:
            self._put("nodes", number, {})
        elif key:
            self._put("nodes", number, _drop_items(node, key))
        elif "matrix" in node and node.keys() & {"translation", "rotation", "scale"}:
            self._node(number, "matrix")
        else:  # in a cycle, or with two parents: it becomes a root
            self.json["nodes"] = [_drop_child(each, number) for each in self.json["nodes"]]

    def _skin(self, number: int, key: str) -> None:
        if key in ("inverseBindMatrices", "skeleton", "name"):
            self._put("skins", number, _drop_items(self.json["skins"][number], key))
            return
        self.skins.add(number)
        if not json_array(self.json, "nodes"):
            self.json.pop("skins")
            return
        self._put("skins", number, {"joints": [0]})
        self._lose("nodes", "skin", number, lambda i: self._node(i, "skin"))


def _objects(json: Json, kind: str) -> list[Json]:
    """The objects of an array; empty if it is not an array."""
    found = json.get(kind)
    return [each if type(each) is dict else {} for each in found] if type(found) is list else []


def _list(value: Json, key: str) -> list[Json]:
    found = value.get(key)
    return [each for each in found if type(each) is dict] if type(found) is list else []


def _views_named(accessor: Json) -> Iterable[Any]:
    try:
        return views_of(accessor)
    except (KeyError, TypeError):  # reported as a fault of its own later
        return [accessor.get("bufferView")]


def _accessors_of(mesh: Json) -> Iterable[Any]:
    for primitive in _list(mesh, "primitives"):
        yield primitive.get("indices")
        for attributes in (primitive.get("attributes"), *_list(primitive, "targets")):
            yield from attributes.values() if type(attributes) is dict else ()


def _drop_items(value: Any, key: str) -> Any:
    return {k: v for k, v in value.items() if k != key} if type(value) is dict else value


def _drop_child(node: Any, child: int) -> Any:
    if type(node) is not dict or child not in node.get("children", ()):
        return node
    return {**node, "children": [each for each in node["children"] if each != child]}
