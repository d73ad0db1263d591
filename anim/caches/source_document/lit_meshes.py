"""Test meshes for normals that a material shades."""

from __future__ import annotations

from collections.abc import Iterable

from anim.gltf.document import Json, json_array

UNLIT = "KHR_materials_unlit"


def has_lit_normals(json: Json, nodes: Iterable[int]) -> bool:
    """Return whether a mesh on the nodes has normals and a material that they shade."""
    materials = json_array(json, "materials")
    for node in nodes:
        for primitive in json["meshes"][json["nodes"][node]["mesh"]]["primitives"]:
            number = primitive.get("material")
            material = materials[number] if type(number) is int else {}
            if "NORMAL" in primitive["attributes"] and UNLIT not in material.get("extensions", {}):
                return True
    return False


def has_mapped_tangents(json: Json, nodes: Iterable[int]) -> bool:
    """Return whether all primitives on the nodes have tangents, and one of them a normal map."""
    materials = json_array(json, "materials")
    primitives = [each for node in nodes for each in json["meshes"][json["nodes"][node]["mesh"]]["primitives"]]
    used = {each["material"] for each in primitives if type(each.get("material")) is int}
    is_mapped = any("normalTexture" in materials[number] for number in used)
    return is_mapped and all("TANGENT" in each["attributes"] for each in primitives)
