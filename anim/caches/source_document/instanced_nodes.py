"""Nodes that show copies of a baked mesh by EXT_mesh_gpu_instancing."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from anim.caches.source_document.bake_source import BakeSource
from anim.errors import UnsupportedError
from anim.gltf.document import Json, node_label
from anim.gltf.validation import hierarchy
from anim.gltf.validation.channel_targets import channel_target
from anim.gltf.writing.reindex import INSTANCING

TRANSFORMS = frozenset({"translation", "rotation", "scale", "matrix"})


def check_copies(source: BakeSource, json: Json, nodes: Collection[int]) -> None:
    """Raise UnsupportedError for a node with copies if they would be lost or at other places in the edited JSON.

    Players transform vertices by the copy first, then by the node: those of a node that has another transform now, in
    world space or for the scale of quantized vertices, would move. nodes: those of baked meshes.
    """
    instanced = [each for each in sorted(nodes) if INSTANCING in json["nodes"][each].get("extensions", {})]
    if not instanced:
        return
    moving = frozenset[int]() if source.in_mesh_space else _moving_nodes(source)
    parents = hierarchy.parents(source.document.json)
    for node in instanced:
        is_moved = not moving.isdisjoint(_with_ancestors(node, parents))
        if is_moved or "mesh" not in json["nodes"][node] or _own_transform(source.document.json, json, node):
            raise UnsupportedError(
                f"{node_label(source.document.json, node)} has copies of its mesh by {INSTANCING}, which would be lost "
                "or elsewhere",
                help="bake in mesh space, as morph targets (`space` mesh, `layout` morph, without `quantize`), or make "
                "the copies real nodes where the file is made",
            )


def _own_transform(before: Json, after: Json, node: int) -> bool:
    """True if the node has another transform of its own than before."""
    old, new = ({key: each["nodes"][node].get(key) for key in TRANSFORMS} for each in (before, after))
    return old != new


def _moving_nodes(source: BakeSource) -> frozenset[int]:
    """Nodes with a transform, at rest or in the baked clip."""
    json = source.document.json
    clip = [] if source.clip is None else json["animations"][source.clip]["channels"]
    targets = [target for channel in clip if (target := channel_target(channel)) is not None]
    moving = {node for node, path, _ in targets if node is not None and path in TRANSFORMS}
    return frozenset(moving | {i for i, node in enumerate(json["nodes"]) if not TRANSFORMS.isdisjoint(node)})


def _with_ancestors(node: int, parents: Sequence[int]) -> list[int]:
    found = []
    while node >= 0:
        found.append(node)
        node = parents[node]
    return found
