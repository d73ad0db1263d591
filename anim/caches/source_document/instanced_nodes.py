"""Nodes that show copies of a baked mesh by EXT_mesh_gpu_instancing."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from anim.arrays import Bools
from anim.caches.source_document.bake_source import BakeSource
from anim.errors import UnsupportedError
from anim.gltf.document import Json, node_label
from anim.gltf.reading.scene_nodes import INSTANCING
from anim.gltf.validation import hierarchy
from anim.gltf.validation.channel_targets import channel_target
from anim.maths.hierarchy import with_descendants

TRANSFORMS = frozenset({"translation", "rotation", "scale", "matrix"})


def check_copies(source: BakeSource, json: Json, nodes: Collection[int]) -> None:
    """Raise UnsupportedError for a node with copies if they would be lost or at other places in the edited JSON.

    Players transform vertices by the copy first, then by the node: those of a node that has another transform now, in
    world space or for the scale of quantized vertices, would move. nodes: those of baked meshes.
    """
    instanced = [each for each in sorted(nodes) if INSTANCING in json["nodes"][each].get("extensions", {})]
    if not instanced:
        return
    is_moved = _moved_nodes(source)
    for node in instanced:
        if is_moved[node] or "mesh" not in json["nodes"][node] or _own_transform(source.document.json, json, node):
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


def _moved_nodes(source: BakeSource) -> Bools:
    """Mask (N,) of nodes that the bake takes from a transform, their own or one above, at rest or in the clip."""
    json = source.document.json
    found = np.zeros(len(json["nodes"]), np.bool_)
    if source.in_mesh_space:
        return found
    clip = [] if source.clip is None else json["animations"][source.clip]["channels"]
    targets = [target for channel in clip if (target := channel_target(channel)) is not None]
    found[[node for node, path, _ in targets if node is not None and path in TRANSFORMS]] = True
    found |= [not TRANSFORMS.isdisjoint(node) for node in json["nodes"]]
    return with_descendants(np.array(hierarchy.parents(json), np.int64), found)
