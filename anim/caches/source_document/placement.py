"""Nodes and meshes of a document that take the place of its skinned ones."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from anim.caches.source_document.bake_source import BakedMesh, BakeSource, baked_name
from anim.gltf.document import Json, json_array
from anim.gltf.validation import hierarchy

TRANSFORMS = ("translation", "rotation", "scale", "matrix")


def detach_meshes(json: Json, nodes: Collection[int]) -> None:
    """Remove mesh, skin and weights from nodes, in place."""
    for node in nodes:
        for key in ("mesh", "skin", "weights"):
            json["nodes"][node].pop(key, None)


def add_mesh(json: Json, mesh: Json, old: int) -> int:
    """Store a mesh in place of the `old` one, or after all if a node uses that; return its index."""
    if any(node.get("mesh") == old for node in json["nodes"]):
        json["meshes"].append(mesh)
        return len(json["meshes"]) - 1
    json["meshes"][old] = mesh
    return old


def place_node(json: Json, baked: BakedMesh, source: BakeSource, node: Json) -> int:
    """Add what `node` has to the node of a baked mesh, or to a new node in its space; return the index.

    Vertices in mesh space stay on their node, or below it if `node` has a transform. Vertices in world space belong to
    a root: the node itself, without its transform, if it has no children and is no joint, else a new one.
    """
    own = json["nodes"][baked.node]
    joints = {joint for skin in json_array(source.document.json, "skins") for joint in skin["joints"]}
    is_free = not own.get("children") and baked.node not in joints and not source.in_mesh_space
    if not is_free and (not source.in_mesh_space or any(key in node for key in (*TRANSFORMS, "extras"))):
        return place_new_node(json, baked, source, node)
    if not source.in_mesh_space:
        _make_root(json, baked.node, _scenes_of(json, baked.node))
        for key in TRANSFORMS:
            own.pop(key, None)
    extras = own.get("extras")
    own.update(node)
    if isinstance(extras, dict) and "extras" in node:
        own["extras"] = {**extras, **node["extras"]}
    return baked.node


def place_new_node(json: Json, baked: BakedMesh, source: BakeSource, node: Json) -> int:
    """Append a node, below that of a baked mesh in mesh space, else to the scenes that hold it; return its index."""
    json["nodes"].append({"name": baked_name(json, baked.node), **node})
    index = len(json["nodes"]) - 1
    if source.in_mesh_space:
        json["nodes"][baked.node].setdefault("children", []).append(index)
    else:
        for scene in _scenes_of(json, baked.node):
            scene["nodes"].append(index)
    return index


def _scenes_of(json: Json, node: int) -> list[Json]:
    """Scenes that hold a node."""
    parents = hierarchy.parents(json)
    chain = {node}
    while parents[node] >= 0:
        node = parents[node]
        chain.add(node)
    return [scene for scene in json_array(json, "scenes") if chain.intersection(scene.get("nodes", ()))]


def _make_root(json: Json, node: int, scenes: Sequence[Json]) -> None:
    """Move a node from its parent to the roots of scenes, in place."""
    for each in json["nodes"]:
        children = each.get("children", [])
        if node in children:
            children.remove(node)
            if not children:
                del each["children"]
    for scene in scenes:
        if node not in scene.setdefault("nodes", []):
            scene["nodes"].append(node)
