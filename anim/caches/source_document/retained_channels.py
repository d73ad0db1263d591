"""Channels and skins that a document needs after its skinned meshes were baked."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from anim.gltf.document import Json, json_array
from anim.gltf.validation import channel_targets, hierarchy
from anim.model import parse_weight_pointer


def drop_unused_skins(json: Json) -> None:
    """Remove all skins, in place, unless a node uses one."""
    if not any("skin" in node for node in json_array(json, "nodes")):
        json.pop("skins", None)


def retained_channels(
    animation: Json, source: Json, edited: Json, baked: Collection[int], roots: Collection[int], *, keep_skeleton: bool
) -> list[Json]:
    """Return the channels of an animation that still move something in the edited JSON.

    source: the JSON before. baked: its nodes whose vertices were baked; their morph weights are dropped. roots: nodes
    with vertices in world space, which nothing may move. A node moves something if it, or a node below, has a mesh, a
    camera or an extension, or is a joint of a used skin; nodes that no joint is below keep their channels too.
    keep_skeleton: keep all others.
    """
    nodes = _moving_nodes(source, edited, baked, keep_skeleton=keep_skeleton) - set(roots)
    morphed = {i: node["mesh"] for i, node in enumerate(source["nodes"]) if "mesh" in node and i not in baked}
    return [each for each in animation["channels"] if _is_retained(each, nodes, morphed, baked)]


def _is_retained(channel: Json, nodes: Collection[int], meshes: Mapping[int, int], baked: Collection[int]) -> bool:
    """meshes: by node, of those that were not baked."""
    target = channel_targets.channel_target(channel)
    if target is None:
        return True
    node, path, pointer = target
    if node is None:
        found = parse_weight_pointer(pointer)
        return found is None or found.owner_index in (meshes if found.owner == "nodes" else meshes.values())
    return node not in baked if path == "weights" else node in nodes


def _moving_nodes(source: Json, edited: Json, baked: Collection[int], *, keep_skeleton: bool) -> set[int]:
    """Nodes whose transform matters."""
    nodes = range(len(json_array(source, "nodes")))
    if keep_skeleton:
        return set(nodes)
    parents = hierarchy.parents(source)
    used = {node["skin"] for node in edited["nodes"] if "skin" in node}
    skins = json_array(source, "skins")
    joints = {joint for skin in skins for joint in skin["joints"]}
    content = {joint for i in used for joint in skins[i]["joints"]}
    content |= {i for i in nodes if any(key in edited["nodes"][i] for key in ("mesh", "camera", "extensions"))}
    gone = _with_ancestors(joints | set(baked), parents) - content
    return _with_ancestors(content, parents) | set(nodes) - gone


def _with_ancestors(nodes: Collection[int], parents: list[int]) -> set[int]:
    found: set[int] = set()
    for node in nodes:
        at = node
        while at >= 0 and at not in found:
            found.add(at)
            at = parents[at]
    return found
