"""Extensions that are not known, at any depth of a document, and the indices that they may contain."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import chain
from typing import Any, TypeAlias

from anim.gltf.document import Json

# Extensions known to contain no index of an accessor or view, other than those that `references` collects. Whole
# numbers and JSON pointers inside any other extension are taken for both: everything they may refer to is kept.
# Extras belong to the application: by the specification no number in them is a reference.
HARMLESS = frozenset(
    """
    EXT_mesh_gpu_instancing EXT_meshopt_compression EXT_texture_avif EXT_texture_webp
    KHR_animation_pointer KHR_draco_mesh_compression KHR_lights_punctual KHR_materials_anisotropy
    KHR_materials_clearcoat KHR_materials_dispersion KHR_materials_emissive_strength KHR_materials_ior
    KHR_materials_iridescence KHR_materials_pbrSpecularGlossiness KHR_materials_sheen KHR_materials_specular
    KHR_materials_transmission KHR_materials_unlit KHR_materials_variants KHR_materials_volume
    KHR_implicit_shapes KHR_mesh_quantization KHR_meshopt_compression KHR_node_visibility KHR_physics_rigid_bodies
    KHR_texture_basisu KHR_texture_transform
    KHR_xmp_json_ld VRM VRMC_materials_mtoon VRMC_node_constraint VRMC_springBone VRMC_vrm VRMC_vrm_animation
    """.split()  # noqa: SIM905 (one name per line would hide the words)
)

NAMING_MESHES = frozenset({"VRM", "KHR_physics_rigid_bodies"})  # of these extensions, by index

# Properties in the longest arrays of files; by the schema each is a number or a string.
_PLAIN = frozenset(
    """
    buffer bufferView byteLength byteOffset componentType count input interpolation node output path sampler type
    """.split()  # noqa: SIM905 (as above)
)
_CONTAINERS = (dict, list)  # of JSON
_SCALARS = frozenset({str, int, float, bool, type(None)})  # a lookup is half as long as isinstance
_LONG_ARRAYS = frozenset({"accessors", "bufferViews", "animations", "samplers", "channels", "target"})  # and below
MAX_PROPERTIES = 64  # of objects that are looked at property by property
_POINTERS = {  # JSON pointers to elements of an array, also with a # or a file's name before them
    key: re.compile(rf"\b(?:{key})/([0-9]{{1,18}})") for key in ("accessors|bufferViews", "buffers", "meshes", "nodes")
}
_Path: TypeAlias = tuple["_Path", str | int] | None  # of a value in JSON: its parent's, and its key or index there


def unknown_extensions(json: Json, known: frozenset[str] = HARMLESS) -> list[tuple[str, Any]]:
    """Return (JSON pointer, content) of extensions that are not known, at any depth."""
    found: list[tuple[str, Any]] = []
    extended = {key: item for key, item in json.items() if key == "extensions" or _has_extensions(key, item)}
    _collect_unknown(extended, None, known, found)
    return found


def _has_extensions(name: str, value: Any) -> bool:
    """Return False if there are no extensions in a property of the document, at any depth.

    By property over all objects, in half the time of a walk: the long arrays of most files have none. True also where
    types are mixed or properties many, which a walk finds out.
    """
    columns = [([value], name in _LONG_ARRAYS)]  # whether the schema knows the objects
    while columns:
        column, in_schema = columns.pop()
        kinds = set(map(type, column))
        if kinds == {list}:
            columns.append(([*chain.from_iterable(column)], in_schema))
        elif kinds == {dict}:
            keys = set(chain.from_iterable(column)) - {"extras"} - (_PLAIN if in_schema else frozenset())
            if "extensions" in keys or len(keys) > MAX_PROPERTIES:
                return True
            columns += [
                ([each[key] for each in column if key in each], in_schema and key in _LONG_ARRAYS) for key in keys
            ]
        elif not kinds <= _SCALARS:
            return True
    return False


def _collect_unknown(value: Json | list[Any], path: _Path, known: frozenset[str], found: list[tuple[str, Any]]) -> None:
    """Append the extensions inside a value that are not known; its pointer is `path`.

    This goes through up to 100 000 objects: pointers are only written out where one is needed.
    """
    for key, item in enumerate(value) if isinstance(value, list) else value.items():
        if type(item) in _SCALARS or not item or key == "extras":
            continue
        if key == "extensions" and isinstance(item, dict):
            for name, extension in item.items():
                if name not in known:
                    found.append((_pointer(((path, key), name)), extension))
                elif isinstance(extension, _CONTAINERS):
                    _collect_unknown(extension, ((path, key), name), known, found)
        elif isinstance(item, _CONTAINERS):
            _collect_unknown(item, (path, key), known, found)


def _pointer(path: _Path) -> str:
    """JSON pointer of a position: ((None, "nodes"), 3) → "/nodes/3"."""
    return "" if path is None else f"{_pointer(path[0])}/{path[1]}"


def possible_indices(value: Any) -> set[int]:
    """Return all that may be an index of an accessor or view inside an extension: whole numbers, and JSON pointers.

    {"a": 1, "b": [2.0, 0.5], "c": "/accessors/3"} → {1, 2, 3}
    """
    return {number for _, item in _scalars(value) for number in _indices(item, "accessors|bufferViews")}


def possible_mesh_indices(value: Any) -> set[int]:
    """Return all that may be an index of a mesh inside an extension."""
    return {number for _, item in _scalars(value) for number in _indices(item, "meshes")}


def possible_node_indices(value: Any) -> set[int]:
    """Return all that may be an index of a node inside an extension."""
    return {number for _, item in _scalars(value) for number in _indices(item, "nodes")}


def extensions_naming_clips(json: Json) -> list[str]:
    """Return positions of unknown extensions that may name an animation by its index, as JSON pointers.

    Those with the word in a name, a text or their own name, such as KHR_interactivity: any number may be one there.
    """
    return [place for place, part in unknown_extensions(json) if "animation" in f"{place} {part}".lower()]


def possible_nodes(json: Json) -> set[int]:
    """Return all that may be an index of a node inside extensions.

    Known ones name a node by "node", as VRM's expressions and colliders do; in unknown ones any number may be one.
    """
    unknown = (possible_node_indices(part) for _, part in unknown_extensions(json))
    every = (pair for _, part in unknown_extensions(json, frozenset()) for pair in _scalars(part))
    return {number for key, item in every if key == "node" for number in _indices(item, "nodes")}.union(*unknown)


def named_buffers(value: Any) -> set[int]:
    """Return the buffers that an extension refers to directly: {"buffer": 1}, or by a JSON pointer."""
    return {
        number
        for key, item in _scalars(value)
        if key in ("buffer", "buffers") or type(item) is str
        for number in _indices(item, "buffers")
    }


def whole_number(value: Any) -> int | None:
    """Return a number of JSON without a fraction, which some exporters write as 6.0; None for any other value."""
    if type(value) is int:
        return value
    return int(value) if type(value) is float and value.is_integer() else None


def _indices(item: Any, arrays: str) -> list[int]:
    """Index that a scalar is, or those that a text has in JSON pointers to elements of `arrays`."""
    if type(item) is str:
        return list(map(int, _POINTERS[arrays].findall(item))) if "/" in item else []
    number = whole_number(item)
    return [] if number is None else [number]


def _scalars(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield (key, scalar) of all scalars inside a value, without extras; keys too, for these may be JSON pointers."""
    stack: list[tuple[str, Any]] = [("", value)]
    while stack:
        key, item = stack.pop()
        if isinstance(item, list):
            stack += [(key, each) for each in item]
        elif isinstance(item, dict):
            for name, each in item.items():
                if name != "extras":
                    stack += (("", name), (name, each))
        else:
            yield key, item
