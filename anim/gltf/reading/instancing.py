"""EXT_mesh_gpu_instancing: nodes with many instances of a mesh, of which a Scene has one."""

from __future__ import annotations

from anim.errors import UnsupportedError
from anim.gltf.document import Document, Json, json_array, node_label

EXTENSION = "EXT_mesh_gpu_instancing"


def instanced_nodes(json: Json) -> list[int]:
    """Return the indices of the nodes with mesh instances."""
    nodes = enumerate(json_array(json, "nodes"))
    return [i for i, node in nodes if "mesh" in node and EXTENSION in node.get("extensions", {})]


def check_not_required(document: Document) -> None:
    """Raise UnsupportedError if the file requires mesh instancing.

    An error bound of one instance does not hold for the others.
    """
    json = document.json
    if EXTENSION in json.get("extensionsRequired", ()) and (found := instanced_nodes(json)):
        raise UnsupportedError(
            f"{node_label(json, found[0])} has copies of its mesh by {EXTENSION}, which is required and not read here"
        )
