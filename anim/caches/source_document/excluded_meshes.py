"""Remove meshes that no node has any more."""

from __future__ import annotations

import re
from collections.abc import Collection

from anim.gltf.document import Json, json_array
from anim.gltf.writing.references import possible_meshes

_MESH_POINTER = re.compile(r"^/meshes/(0|[1-9][0-9]{0,8})(?=/)")


def drop_meshes(json: Json, candidates: Collection[int], clip: Json) -> None:
    """Remove those of the candidates that no node has, in place, and renumber the others.

    clip: the baked animation, whose pointers are renumbered too. If a number in an extension may be a mesh
    after the first removed one, nothing is removed.
    """
    meshes = json_array(json, "meshes")
    gone = set(candidates) - {node["mesh"] for node in json["nodes"] if "mesh" in node}
    if not gone or any(min(gone) <= number < len(meshes) for number in possible_meshes(json)):
        return
    kept = [i for i in range(len(meshes)) if i not in gone]
    number = {old: new for new, old in enumerate(kept)}
    json["meshes"] = [meshes[i] for i in kept]
    if not json["meshes"]:
        del json["meshes"]
    for node in json["nodes"]:
        if "mesh" in node:
            node["mesh"] = number[node["mesh"]]
    clip["channels"] = [each for channel in clip["channels"] if (each := _renumber(channel, number)) is not None]


def _renumber(channel: Json, number: dict[int, int]) -> Json | None:
    """The channel with the new index of the mesh in its pointer; None if the mesh was removed."""
    about = channel["target"].get("extensions", {}).get("KHR_animation_pointer", {})
    found = _MESH_POINTER.match(about.get("pointer", ""))
    if found is None:
        return channel
    if int(found[1]) not in number:
        return None
    pointer = f"/meshes/{number[int(found[1])]}{about['pointer'][found.end() :]}"
    extensions = {**channel["target"]["extensions"], "KHR_animation_pointer": {**about, "pointer": pointer}}
    return {**channel, "target": {**channel["target"], "extensions": extensions}}
