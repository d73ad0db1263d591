"""References to accessors and views: droppable and immovable ones while clips are replaced."""

from __future__ import annotations

import operator
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import NamedTuple

from anim.gltf.document import Json, json_array
from anim.gltf.writing.unknown_extensions import (
    HARMLESS,
    NAMING_MESHES,
    named_buffers,
    possible_indices,
    possible_mesh_indices,
    unknown_extensions,
)


class References(NamedTuple):
    """Indices of accessors and views with references outside the replaced animations.

    frozen_buffers: those that unknown extensions refer to directly: their bytes must not move.
    unknown: all in unknown extensions that may be an index of an accessor or view.
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
    unknown, frozen = possible_indices(parts), frozenset(named_buffers(parts))
    return References(frozenset(accessors | unknown), frozenset(views | unknown), frozen, frozenset(unknown))


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
    """Return all in extensions that may be an index of a mesh: in unknown ones, and some others."""
    return possible_mesh_indices([part for _, part in unknown_extensions(json, HARMLESS - NAMING_MESHES)])


def extensions_naming_keys(json: Json, animations: Iterable[int]) -> list[str]:
    """Return positions in unknown extensions that may refer to key data of `animations`.

    As JSON pointers: ["/nodes/3/extensions/ACME_path"]. Those bytes are kept.
    """
    unknown = unknown_extensions(json)
    if not unknown:
        return []
    accessors, samplers = json_array(json, "accessors"), json_array(json, "animations")
    keys = {key for i in animations for key in sampled_accessors(samplers[i]["samplers"])}
    of_keys = views_of_all(accessors[number] for number in keys)
    named = keys | of_keys
    buffers = {json_array(json, "bufferViews")[view]["buffer"] for view in of_keys}
    return [
        place
        for place, part in unknown
        if not named.isdisjoint(possible_indices(part)) or not buffers.isdisjoint(named_buffers(part))
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
            yield from possible_indices(node["extensions"].get("EXT_mesh_gpu_instancing", {}))


def _of_draco(json: Json) -> Iterator[int]:
    for primitive in _primitives(json):
        draco = primitive.get("extensions", {}).get("KHR_draco_mesh_compression")
        if isinstance(draco, dict):  # its other numbers are ids inside the Draco data
            yield from possible_indices(draco.get("bufferView"))
