"""Target properties of channels: a node's own, or any property by KHR_animation_pointer."""

from __future__ import annotations

import re
from typing import TypeAlias

from anim.errors import FormatError, NotFoundError, RangeError
from anim.gltf.document import Json, json_array
from anim.model import parse_weight_pointer
from anim.model.track import PATHS

EXTENSION = "KHR_animation_pointer"
_NODE_PROPERTY = r"/nodes/(0|[1-9][0-9]{0,8})/(translation|rotation|scale|weights)"

Target: TypeAlias = tuple[int | None, str, str | None]  # node, path, pointer


def channel_target(channel: Json) -> Target | None:
    """Return (node, path, pointer) of a channel, None if glTF ignores the target or it is unknown.

    A pointer at a node's translation, rotation, scale or weights gives that node and path, like a plain channel.
    channel_target({"sampler": 0, "target": {"node": 3, "path": "scale"}}) → (3, "scale", None)
    """
    target = channel["target"]
    path = target["path"]
    if path == "pointer":
        return _pointer_target(target.get("extensions", {}).get(EXTENSION))
    if path not in PATHS or "node" not in target:
        return None
    return target["node"], path, None


def check(json: Json) -> None:
    """Raise FormatError for a channel on a missing node, or a second one for the same property.

    Files of real exporters contain two channels for one pointer outside the nodes; they are read and kept.
    """
    count = len(json_array(json, "nodes"))
    for i, animation in enumerate(json_array(json, "animations")):
        if not animation["channels"]:
            continue
        targets = [channel_target(channel) for channel in animation["channels"]]
        animated = [(each[0], each[1]) for each in targets if each is not None and each[0] is not None]
        if len(set(animated)) == len(animated) and max([node for node, _ in animated], default=0) < count:
            continue
        seen: set[tuple[int, str]] = set()
        for k, target in enumerate(targets):
            try:
                _check(target, count, seen)
            except FormatError as error:
                raise error.at(f"animations[{i}].channels[{k}].target", ".") from None


def check_node(json: Json, node: int, path: str, width: int) -> None:
    """Raise NotFoundError or RangeError unless the node has an animatable `path` of `width` values."""
    nodes = json_array(json, "nodes")
    if node >= len(nodes):
        raise NotFoundError(f"there is no node {node} (the file has {len(nodes)}, from 0 on)")
    if path == "weights":
        count = target_count(json, node)
        if width != count:
            raise RangeError(f"has {width} weights for {count} morph targets")


def target_count(json: Json, node: int) -> int:
    """Return the morph target count of a node's mesh."""
    mesh = json_array(json, "nodes")[node].get("mesh")
    primitives = json_array(json, "meshes")[mesh]["primitives"] if mesh is not None else []
    return len(primitives[0].get("targets", ())) if primitives else 0


def _check(target: Target | None, count: int, seen: set[tuple[int, str]]) -> None:
    """Check the target of a channel. count: number of nodes. seen: properties of the clip's channels before it."""
    if target is None:
        return
    node, path, _ = target
    if node is None:
        return
    if (node, path) in seen:
        raise FormatError(f"is the second channel for node {node}, {path}")
    seen.add((node, path))
    if node >= count:
        raise FormatError(f"names node {node} (the file has {count} nodes)")


def has_weight_pointers(json: Json) -> bool:
    """Return whether a channel points to morph weights of a mesh, or to a single one, which have no path of a node."""
    channels = (channel for animation in json_array(json, "animations") for channel in animation["channels"])
    targets = map(channel_target, channels)
    return any(found is not None and found[0] is None and parse_weight_pointer(found[2]) for found in targets)


def _pointer_target(extension: object) -> Target | None:
    pointer = extension.get("pointer") if isinstance(extension, dict) else None
    if not isinstance(pointer, str):
        return None
    match = re.fullmatch(_NODE_PROPERTY, pointer)
    return (int(match[1]), match[2], pointer) if match else (None, "pointer", pointer)
