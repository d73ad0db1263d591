"""Notes on nodes that are not written to USD."""

from __future__ import annotations

from anim.gltf.document import Json, json_array

LIGHTS = "KHR_lights_punctual"


def node_loss_notes(json: Json) -> list[str]:
    """Return a line for cameras and one for lights, if nodes have them."""
    nodes = json_array(json, "nodes")
    found = ["cameras are left out"] if any("camera" in node for node in nodes) else []
    if any(LIGHTS in (node.get("extensions") or {}) for node in nodes):
        found.append("lights are left out")
    return found
