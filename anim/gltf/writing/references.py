"""References to accessors and views: droppable and immovable ones while clips are replaced."""

from __future__ import annotations

import operator
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import chain
from typing import Any, NamedTuple, TypeAlias

from anim.gltf.document import Json, json_array

# Extensions known to contain no index of an accessor or view, other than those collected below. Numbers inside any
# other extension are taken for both: everything they may refer to is kept. Extras belong to the application:
# by the specification no number in them is a reference.
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
_Path: TypeAlias = tuple["_Path", str | int] | None  # of a value in JSON: its parent's, and its key or index there


class References(NamedTuple):
    """Indices of accessors and views with references outside the replaced animations.

    frozen_buffers: those that unknown extensions refer to directly: their bytes must not move.
    unknown: all whole numbers in unknown extensions: each may be an index of an accessor or view.
    """

    accessors: frozenset[int]
    views: frozenset[int]
    frozen_buffers: frozenset[int]
    unknown: frozenset[int]


def references_outside(json: Json, replaced: Iterable[int]) -> References:
    """Return all references except those of the samplers of the animations `replaced`.

    Accessors in the result keep index and bytes. Views in it have references other than accessors; views of an accessor
    in the result must be added by the caller, since parts of those may be dropped.
    """
    accessors = named_accessors(json, set(replaced))
    views = {image["bufferView"] for image in json_array(json, "images") if "bufferView" in image}
    views |= set(_of_draco(json))
    parts = [part for _, part in unknown_extensions(json)]
    unknown = {number for part in parts for number in _whole_numbers(part)}
    frozen = {part["buffer"] for part in _objects(parts) if type(part.get("buffer")) is int}
    return References(frozenset(accessors | unknown), frozenset(views | unknown), frozenset(frozen), frozenset(unknown))


def named_accessors(json: Json, skipped: Collection[int] = ()) -> set[int]:
    """Return the accessors of meshes, skins, known extensions and animations but those `skipped`."""
    found = set(_of_meshes(json)) | set(_of_skins(json)) | set(_of_instancing(json))
    for i, animation in enumerate(json_array(json, "animations")):
        if i not in skipped:
            found |= sampled_accessors(animation["samplers"])
    return found


def sampled_accessors(samplers: Sequence[Json]) -> set[int]:
    """Return the accessors of samplers: of their key times and values."""
    return {*map(operator.itemgetter("input"), samplers), *map(operator.itemgetter("output"), samplers)}


def possible_meshes(json: Json) -> set[int]:
    """Return all whole numbers in extensions that may be an index of a mesh: in unknown ones, and some others."""
    named = unknown_extensions(json, HARMLESS - NAMING_MESHES)
    return {number for _, part in named for number in _whole_numbers(part)}


def extensions_naming_keys(json: Json, animations: Iterable[int]) -> list[str]:
    """Return positions in unknown extensions that may refer to key data of `animations`.

    As JSON pointers: ["/nodes/3/extensions/ACME_path"]. Those bytes are kept.
    """
    accessors, samplers = json_array(json, "accessors"), json_array(json, "animations")
    keys = {key for i in animations for key in sampled_accessors(samplers[i]["samplers"])}
    of_keys = views_of_all(accessors[number] for number in keys)
    named = keys | of_keys
    buffers = {json_array(json, "bufferViews")[view]["buffer"] for view in of_keys}
    return [
        place
        for place, part in unknown_extensions(json)
        if not named.isdisjoint(_whole_numbers(part))
        or any(type(each.get("buffer")) is int and each["buffer"] in buffers for each in _objects(part))
    ]


def views_of(accessor: Json) -> list[int]:
    """Return the views of an accessor: its own, and those of its sparse part."""
    views = [accessor["bufferView"]] if "bufferView" in accessor else []
    if "sparse" in accessor:
        views += [accessor["sparse"][part]["bufferView"] for part in ("indices", "values")]
    return views


def views_of_all(accessors: Iterable[Json]) -> set[int]:
    """Return the views of all of these accessors: few have a sparse part."""
    described = list(accessors)
    sparse = [about for about in described if "sparse" in about]
    views = {about["bufferView"] for about in described if "bufferView" in about}
    return views.union(*map(views_of, sparse))


def _primitives(json: Json) -> Iterator[Json]:
    for mesh in json_array(json, "meshes"):
        yield from mesh["primitives"]


def _of_meshes(json: Json) -> Iterator[int]:
    for primitive in _primitives(json):
        yield from primitive["attributes"].values()
        if "indices" in primitive:
            yield primitive["indices"]
        for target in primitive.get("targets", ()):
            yield from target.values()


def _of_skins(json: Json) -> Iterator[int]:
    return (skin["inverseBindMatrices"] for skin in json_array(json, "skins") if "inverseBindMatrices" in skin)


def _of_instancing(json: Json) -> Iterator[int]:
    for node in json_array(json, "nodes"):
        if "extensions" in node:
            yield from _whole_numbers(node["extensions"].get("EXT_mesh_gpu_instancing", {}))


def _of_draco(json: Json) -> Iterator[int]:
    for primitive in _primitives(json):
        draco = primitive.get("extensions", {}).get("KHR_draco_mesh_compression")
        if isinstance(draco, dict):  # its other numbers are ids inside the Draco data
            yield from _whole_numbers(draco.get("bufferView"))


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


def _objects(value: Any) -> Iterator[Json]:
    if isinstance(value, dict):
        yield value
    if isinstance(value, dict | list):
        for item in _inside(value):
            yield from _objects(item)


def _whole_numbers(value: Any) -> Iterator[int]:
    if type(value) is int:
        yield value
    elif isinstance(value, dict | list):
        for item in _inside(value):
            yield from _whole_numbers(item)


def _inside(value: Json | list[Any]) -> Iterator[Any]:
    """Values of an object or a list, without extras."""
    yield from (item for key, item in value.items() if key != "extras") if isinstance(value, dict) else value
