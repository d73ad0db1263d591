"""The scene that three.js shows: the default one, else one of all root nodes."""

from __future__ import annotations

from anim.gltf.document import Json, json_array
from anim.gltf.validation import hierarchy


def show_scene(json: Json) -> list[str]:
    """Add a scene of all root nodes to a JSON without scenes, in place; return notes about meshes not shown."""
    if not json_array(json, "scenes"):
        roots = [i for i, parent in enumerate(hierarchy.parents(json)) if parent < 0]
        json["scenes"], json["scene"] = [{"nodes": roots}] if roots else [{}], 0
        return []
    shown = shown_nodes(json)
    hidden = sum("mesh" in node and i not in shown for i, node in enumerate(json_array(json, "nodes")))
    if not hidden:
        return []
    return [f"{hidden} mesh{'' if hidden == 1 else 'es'} not shown: outside the default scene"]


def shown_nodes(json: Json) -> set[int]:
    """Return the nodes of the default scene, or of the first."""
    nodes, stack = json_array(json, "nodes"), [*json["scenes"][json.get("scene", 0)].get("nodes", ())]
    shown: set[int] = set()
    while stack:
        node = stack.pop()
        shown.add(node)
        stack.extend(nodes[node].get("children", ()))
    return shown
