"""Test meshes for normals that a material shades."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from anim.caches.source_document.checked_materials import find_material
from anim.gltf.document import Json

UNLIT = "KHR_materials_unlit"


def has_lit_normals(json: Json, nodes: Iterable[int]) -> bool:
    """Return whether a mesh on the nodes has normals and a material that they shade."""
    return any(
        "NORMAL" in each["attributes"] and UNLIT not in find_material(json, each.get("material")).get("extensions", {})
        for each in _primitives(json, nodes)
    )


def has_mapped_tangents(json: Json, nodes: Iterable[int]) -> bool:
    """Return whether all primitives on the nodes have tangents, and one of them a normal map."""
    found = list(_primitives(json, nodes))
    is_mapped = any("normalTexture" in find_material(json, each.get("material")) for each in found)
    return is_mapped and all("TANGENT" in each["attributes"] for each in found)


def _primitives(json: Json, nodes: Iterable[int]) -> Iterator[Json]:
    for node in nodes:
        yield from json["meshes"][json["nodes"][node]["mesh"]]["primitives"]
