"""Edits of the hierarchy of nodes, for fixes."""

from __future__ import annotations

from typing import Any

from anim.gltf.document import Json, json_array
from anim.gltf.validation.channel_targets import EXTENSION, Target, channel_target
from anim.gltf.writing.unknown_extensions import possible_nodes
from anim.model import parse_weight_pointer

TRANSFORM = ("translation", "rotation", "scale", "matrix")
MESH = ("mesh", "skin", "weights")


def move_mesh_to_root(json: Json, number: int) -> bool:
    """Make a skinned mesh a root node without transform, in place; return False if that could change more.

    A node that other nodes or tracks need keeps its position; its mesh then moves to a new node, unless an extension
    may name the old one for its mesh, such as the expressions of VRM.
    """
    nodes = json_array(json, "nodes")
    scenes = [i for i, scene in enumerate(json_array(json, "scenes")) if number in _reachable(nodes, scene)]
    if _is_extended(json, number):
        return False
    if _is_needed(json, number):
        if number in possible_nodes(json):
            return False
        number = _split(json, number)
    else:
        _detach(json, number)
    for i in scenes:
        tops = json["scenes"][i].setdefault("nodes", [])
        if number not in tops:
            tops.append(number)
    return True


def _reachable(nodes: list[Json], scene: Json) -> set[int]:
    found: set[int] = set()
    waiting = list(scene.get("nodes", ()))
    while waiting:
        node = waiting.pop()
        if node not in found:
            found.add(node)
            waiting += nodes[node].get("children", ())
    return found


def _is_extended(json: Json, number: int) -> bool:
    """True if the node or one above it has an extension, such as visibility, that it would lose."""
    parents = {child: i for i, node in enumerate(json["nodes"]) for child in node.get("children", ())}
    node: int | None = number
    while node is not None:
        if json["nodes"][node].get("extensions"):
            return True
        node = parents.get(node)
    return False


def _is_needed(json: Json, number: int) -> bool:
    """True if a node has children, is a joint, or has tracks of its transform."""
    node = json["nodes"][number]
    joints = {joint for skin in json_array(json, "skins") for joint in (*skin["joints"], skin.get("skeleton", -1))}
    animated = {target[0] for target in _targets(json) if target[1] != "weights"}
    return bool(node.get("children")) or "camera" in node or number in joints | animated


def _targets(json: Json) -> list[tuple[Any, str]]:
    channels = [each for animation in json_array(json, "animations") for each in animation["channels"]]
    return [target[:2] for each in channels if (target := channel_target(each)) is not None]


def _detach(json: Json, number: int) -> None:
    for key in TRANSFORM:
        json["nodes"][number].pop(key, None)
    for node in json["nodes"]:
        if number in node.get("children", ()):
            node["children"] = [child for child in node["children"] if child != number]
            if not node["children"]:
                del node["children"]


def _split(json: Json, number: int) -> int:
    """Move mesh, skin and morph weights with their tracks to a new node; return its index."""
    node = json["nodes"][number]
    new = {key: node.pop(key) for key in MESH if key in node}
    if "name" in node:
        new["name"] = f"{node['name']}_mesh"
    json["nodes"].append(new)
    index = len(json["nodes"]) - 1
    for animation in json_array(json, "animations"):
        for channel in animation["channels"]:
            found = channel_target(channel)
            if found is not None:
                _redirect(channel["target"], found, number, index)
    return index


def _redirect(target: Json, found: Target, old: int, new: int) -> None:
    """Let a target of morph weights of a node, or of one of them, name another node, in place."""
    node, path, pointer = found
    single = parse_weight_pointer(pointer)
    if (node, path) == (old, "weights") and pointer is None:
        target["node"] = new
    elif single is not None and (single.owner, single.owner_index) == ("nodes", old):
        end = "" if single.target is None else f"/{single.target}"
        target["extensions"][EXTENSION]["pointer"] = f"/nodes/{new}/weights{end}"
