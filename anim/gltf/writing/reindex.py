"""Drop placeholder accessors and views, and renumber all references."""

from __future__ import annotations

from collections.abc import Callable, Set
from typing import Any, TypeAlias

from anim.gltf.document import Document, Json, json_array
from anim.gltf.validation.buffer_layout import DRACO
from anim.gltf.writing import compaction, references
from anim.gltf.writing.insertion import empty_views, placeholders
from anim.gltf.writing.unknown_extensions import whole_number

IndexMaps: TypeAlias = list[int]  # new index by old index

INSTANCING = "EXT_mesh_gpu_instancing"


def drop_placeholders(document: Document) -> Document:
    """Return the document without the placeholders that `replace_clips` leaves in accessors and views.

    References in meshes, skins, animations, images, sparse accessors, EXT_mesh_gpu_instancing and
    KHR_draco_mesh_compression are renumbered. If a number or a JSON pointer in an unknown extension may be
    one of the changed indices, nothing is dropped. An unchanged document is returned itself.
    """
    json = document.json
    if not placeholders(json) and not any(map(compaction.is_placeholder, json_array(json, "bufferViews"))):
        return document
    named = references.references_outside(json, ())
    unknown = named.unknown
    holes = placeholders(json) - named.accessors
    views = empty_views(json, named)
    accessor_count, view_count = len(json_array(json, "accessors")), len(json_array(json, "bufferViews"))
    holes = holes if _is_safe(holes, unknown, accessor_count) else set()
    views = views if _is_safe(views, unknown, view_count) else set()
    if not holes and not views:
        return document
    closed = _renumber(json, _index_maps(holes, accessor_count), _index_maps(views, view_count))
    for key, gone in (("accessors", holes), ("bufferViews", views)):
        left = [each for i, each in enumerate(json_array(closed, key)) if i not in gone]
        if left:
            closed[key] = left
        else:
            closed.pop(key, None)
    return Document(closed, document.buffers, document.chunks, document.indent)


def _is_safe(gone: Set[int], unknown: Set[int], count: int) -> bool:
    """True if no unknown number can be an index after the first dropped one."""
    return not gone or not any(min(gone) <= number < count for number in unknown)


def _index_maps(gone: Set[int], count: int) -> IndexMaps:
    numbers, new = [], 0
    for i in range(count):
        numbers.append(new)
        new += i not in gone
    return numbers


def _renumber(json: Json, accessors: IndexMaps, views: IndexMaps) -> Json:
    """The JSON with renumbered references."""
    closed = dict(json)
    change: dict[str, Callable[[Json], Json]] = {
        "meshes": lambda mesh: _mesh(mesh, accessors, views),
        "skins": lambda skin: _replace_references(skin, "inverseBindMatrices", accessors),
        "animations": lambda animation: _animation(animation, accessors),
        "nodes": lambda node: _node(node, accessors),
        "images": lambda image: _replace_references(image, "bufferView", views),
        "accessors": lambda accessor: _accessor(accessor, views),
    }
    for key, renumbered in change.items():
        if key in json:
            closed[key] = [renumbered(each) for each in json[key]]
    return closed


def _replace_references(about: Json, key: str, numbers: IndexMaps) -> Json:
    return {**about, key: _new_index(about[key], numbers)} if key in about else about


def _mesh(mesh: Json, accessors: IndexMaps, views: IndexMaps) -> Json:
    return {**mesh, "primitives": [_primitive(each, accessors, views) for each in mesh["primitives"]]}


def _primitive(primitive: Json, accessors: IndexMaps, views: IndexMaps) -> Json:
    new = {
        **_replace_references(primitive, "indices", accessors),
        "attributes": _map(primitive["attributes"], accessors),
    }
    if "targets" in primitive:
        new["targets"] = [_map(target, accessors) for target in primitive["targets"]]
    draco = primitive.get("extensions", {}).get(DRACO)
    if isinstance(draco, dict):
        new["extensions"] = {**primitive["extensions"], DRACO: _replace_references(draco, "bufferView", views)}
    return new


def _map(attributes: Json, accessors: IndexMaps) -> Json:
    return {name: _new_index(number, accessors) for name, number in attributes.items()}


def _new_index(number: Any, numbers: IndexMaps) -> Any:
    """The new index; invalid ones are unchanged, since extensions are not validated on reading."""
    index = whole_number(number)
    return number if index is None or not 0 <= index < len(numbers) else numbers[index]


def _animation(animation: Json, accessors: IndexMaps) -> Json:
    samplers = [
        _replace_references(_replace_references(each, "input", accessors), "output", accessors)
        for each in animation["samplers"]
    ]
    return {**animation, "samplers": samplers}


def _node(node: Json, accessors: IndexMaps) -> Json:
    instancing = node.get("extensions", {}).get(INSTANCING)
    if not isinstance(instancing, dict) or not isinstance(instancing.get("attributes"), dict):
        return node
    new = {**instancing, "attributes": _map(instancing["attributes"], accessors)}
    return {**node, "extensions": {**node["extensions"], INSTANCING: new}}


def _accessor(accessor: Json, views: IndexMaps) -> Json:
    new = _replace_references(accessor, "bufferView", views)
    if "sparse" in accessor:
        parts = {
            part: _replace_references(accessor["sparse"][part], "bufferView", views) for part in ("indices", "values")
        }
        new = {**new, "sparse": {**accessor["sparse"], **parts}}
    return new
