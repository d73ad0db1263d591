"""Channels by JSON pointer → plain channels, where three.js then plays the same motion."""

from __future__ import annotations

import re
from collections.abc import Sequence

from anim.gltf.document import Json, json_array
from anim.gltf.reading.accessors import FLOAT, Accessors
from anim.gltf.validation.channel_targets import channel_target
from anim.show.page.embedded_nodes import shown_nodes
from anim.units import plural

MAX_LISTED_POINTERS = 3  # pointers in a note
_MESH_WEIGHTS = re.compile(r"/meshes/(0|[1-9][0-9]{0,8})/weights")


def rewrite_tracks(json: Json, accessors: Accessors) -> list[str]:
    """Replace pointers by plain channels, in place, and return notes about tracks not shown.

    Pointers to a mesh's weights become a channel for each node with the mesh, unless one has weights of its own.
    Channels of nodes outside the default scene, or of a path that glTF does not know, lose their target: three.js
    finds none for them.
    """
    shown = shown_nodes(json)
    pointers: list[str] = []
    outside = 0
    for animation in json_array(json, "animations"):
        channels: list[Json] = []
        for channel in animation["channels"]:
            node, path, pointer = channel_target(channel) or (None, "", None)
            if node is not None:
                channels.append({**channel, "target": {"node": node, "path": path}} if pointer else channel)
            elif pointer is not None:
                plain = _mesh_weights(json, animation, channel, pointer, accessors)
                channels += plain or [channel]
                pointers += [] if plain else [pointer]
            else:
                channels.append(channel)
        for i, channel in enumerate(channels):
            target, is_known = channel["target"], channel_target(channel) is not None
            if "node" in target and (not is_known or target["node"] not in shown):
                channels[i] = {**channel, "target": {key: target[key] for key in target if key != "node"}}
                outside += is_known
        animation["channels"] = channels
    return _notes(pointers, outside)


def _mesh_weights(json: Json, animation: Json, channel: Json, pointer: str, accessors: Accessors) -> list[Json]:
    """Channels of the nodes that a pointer to a mesh's weights moves; none where that is not exact."""
    match = _MESH_WEIGHTS.fullmatch(pointer)
    meshes, nodes = json_array(json, "meshes"), json_array(json, "nodes")
    if match is None or int(match[1]) >= len(meshes):
        return []
    mesh = int(match[1])
    users = [i for i, node in enumerate(nodes) if node.get("mesh") == mesh]
    targets = {channel_target(each) for each in animation["channels"]}
    if any("weights" in nodes[i] or (i, "weights") in {each[:2] for each in targets if each} for i in users):
        return []
    sampler, primitives = animation["samplers"][channel["sampler"]], meshes[mesh]["primitives"]
    output, keys = accessors.about(sampler["output"]), accessors.about(sampler["input"])["count"]
    width = len(primitives[0].get("targets", ())) if primitives else 0
    rows = keys * (3 if sampler.get("interpolation") == "CUBICSPLINE" else 1)
    stored = output["type"] == "SCALAR" and (output["componentType"] == FLOAT or output.get("normalized", False))
    if not width or not stored or output["count"] != rows * width:
        return []
    return [{**channel, "target": {"node": node, "path": "weights"}} for node in users]


def _notes(pointers: Sequence[str], outside: int) -> list[str]:
    notes = []
    if pointers:
        more = f" and {len(pointers) - MAX_LISTED_POINTERS} more" if len(pointers) > MAX_LISTED_POINTERS else ""
        notes.append(f"{plural(len(pointers), 'track')} not shown: {', '.join(pointers[:MAX_LISTED_POINTERS])}{more}")
    if outside:
        notes.append(f"{plural(outside, 'track')} not shown: of nodes outside the default scene")
    return notes
