"""Which property a channel animates: a node's own, or by KHR_animation_pointer anything that a JSON pointer names."""

from __future__ import annotations

import re
from typing import TypeAlias

from anim.errors import FormatError, NotFoundError, RangeError
from anim.gltf.document import Json, json_array
from anim.model.track import PATHS

EXTENSION = "KHR_animation_pointer"
_NODE_PROPERTY = re.compile(r"/nodes/(0|[1-9][0-9]{0,8})/(translation|rotation|scale|weights)")

Target: TypeAlias = tuple[int | None, str, str | None]  # node, path, pointer


def channel_target(channel: Json) -> Target | None:
    """Return (node, path, pointer) that a channel animates, None where glTF says to ignore it or it is not known.

    A pointer at a node's translation, rotation, scale or weights gives that node and path: plain channels could do it.
    of_channel({"sampler": 0, "target": {"node": 3, "path": "scale"}}) → (3, "scale", None)
    """
    target = channel["target"]
    path = target["path"]
    if path == "pointer":
        return _pointer_target(target.get("extensions", {}).get(EXTENSION))
    if path not in PATHS or "node" not in target:
        return None
    return target["node"], path, None


def check(json: Json) -> None:
    """Raise FormatError for a channel on a node that is missing, or a second one for its property.

    Two channels for one pointer outside the nodes stand in files of real exporters; they are read and kept as they are.
    """
    nodes = json_array(json, "nodes")
    for i, animation in enumerate(json_array(json, "animations")):
        seen: set[tuple[int, str]] = set()
        for k, channel in enumerate(animation["channels"]):
            found = channel_target(channel)
            if found is None:
                continue
            try:
                _check(found, nodes, seen)
            except FormatError as error:
                raise error.at(f"animations[{i}].channels[{k}].target", ".") from None


def check_node(json: Json, node: int, path: str, width: int) -> None:
    """Raise NotFoundError or RangeError where no node has a `path` of `width` numbers to animate."""
    nodes = json_array(json, "nodes")
    if node >= len(nodes):
        raise NotFoundError(f"there is no node {node} (the file has {len(nodes)}, from 0 on)")
    if path == "weights":
        count = target_count(json, node)
        if width != count:
            raise RangeError(f"has {width} weights for {count} morph targets")


def target_count(json: Json, node: int) -> int:
    """Return how many morph targets the mesh of a node has."""
    mesh = json_array(json, "nodes")[node].get("mesh")
    primitives = json_array(json, "meshes")[mesh]["primitives"] if mesh is not None else []
    return len(primitives[0].get("targets", ())) if primitives else 0


def _check(target: Target, nodes: list[Json], seen: set[tuple[int, str]]) -> None:
    node, path, _ = target
    if node is None:
        return
    if (node, path) in seen:
        raise FormatError(f"is the second channel for node {node}, {path}")
    seen.add((node, path))
    if node >= len(nodes):
        raise FormatError(f"names node {node} (the file has {len(nodes)} nodes)")


def _pointer_target(extension: object) -> Target | None:
    pointer = extension.get("pointer") if isinstance(extension, dict) else None
    if not isinstance(pointer, str):
        return None
    match = _NODE_PROPERTY.fullmatch(pointer)
    return (int(match[1]), match[2], pointer) if match else (None, "pointer", pointer)
