"""EXT_mesh_gpu_instancing: nodes whose mesh a player shows in many copies, of which a Scene holds one."""

from __future__ import annotations

from anim.errors import UnsupportedError
from anim.gltf.document import Document, Json, json_array, node_label

EXTENSION = "EXT_mesh_gpu_instancing"


def instanced_nodes(json: Json) -> list[int]:
    """Return the numbers of the nodes whose mesh is shown in copies."""
    nodes = enumerate(json_array(json, "nodes"))
    return [i for i, node in nodes if "mesh" in node and EXTENSION in node.get("extensions", {})]


def check_not_required(document: Document) -> None:
    """Raise UnsupportedError where copies of a mesh are required: no bound on one copy holds on the others."""
    json = document.json
    if EXTENSION in json.get("extensionsRequired", ()) and (found := instanced_nodes(json)):
        raise UnsupportedError(
            f"{node_label(json, found[0])} has copies of its mesh by {EXTENSION}, which is required and not read here"
        )
