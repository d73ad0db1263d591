"""Nodes of scenes: their order, those outside the default scene, and copies of meshes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.errors import UnsupportedError
from anim.gltf.document import Document, Json, json_array, node_label
from anim.gltf.validation import hierarchy

INSTANCING = "EXT_mesh_gpu_instancing"


def depth_first(json: Json, parents: Sequence[int] | None = None) -> Iterator[int]:
    """Yield node indices depth-first: from the scenes' roots, each once, then from other roots.

    parents: (N,) of each node, −1 for roots, if the caller has them.
    """
    nodes = json_array(json, "nodes")
    parents = hierarchy.parents(json) if parents is None else parents
    roots = [root for scene in json_array(json, "scenes") for root in scene.get("nodes", ())]
    roots += [i for i, parent in enumerate(parents) if parent < 0]
    seen: set[int] = set()
    stack = list(reversed(roots))
    while stack:
        node = stack.pop()
        if node in seen:
            continue
        seen.add(node)
        yield node
        stack.extend(reversed(nodes[node].get("children", ())))


def mesh_nodes_of_other_scenes(document: Document) -> list[int]:
    """Return the nodes with a mesh outside the default scene: `scene`, else the first; [] without scenes."""
    nodes, scenes = json_array(document.json, "nodes"), json_array(document.json, "scenes")
    if not scenes:
        return []
    shown: set[int] = set()
    stack = list(scenes[document.json.get("scene", 0)].get("nodes", ()))
    while stack:
        node = stack.pop()
        shown.add(node)
        stack.extend(nodes[node].get("children", ()))
    return [i for i, node in enumerate(nodes) if "mesh" in node and i not in shown]


def is_default_scene_empty(document: Document) -> bool:
    """Return whether no mesh is in the default scene; False without scenes."""
    if not json_array(document.json, "scenes"):
        return False
    meshes = sum("mesh" in node for node in json_array(document.json, "nodes"))
    return len(mesh_nodes_of_other_scenes(document)) == meshes


def faces_back(json: Json) -> bool:
    """Return whether figures look along −Z, as those of VRM 0.x do; along +Z in glTF and VRM 1.0."""
    extensions = json.get("extensions")
    return isinstance(extensions, dict) and "VRM" in extensions and "VRMC_vrm" not in extensions


def instanced_nodes(json: Json) -> list[int]:
    """Return the indices of the nodes with mesh instances."""
    nodes = enumerate(json_array(json, "nodes"))
    return [i for i, node in nodes if "mesh" in node and INSTANCING in node.get("extensions", {})]


def check_not_required(document: Document) -> None:
    """Raise UnsupportedError if the file requires mesh instancing.

    An error bound of one instance does not hold for the others.
    """
    json = document.json
    if INSTANCING in json.get("extensionsRequired", ()) and (found := instanced_nodes(json)):
        raise UnsupportedError(
            f"{node_label(json, found[0])} has copies of its mesh by {INSTANCING}, which is required and not read here"
        )
