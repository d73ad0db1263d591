"""Notes on unknown extensions that may name what a bake changes: clips, and nodes whose mesh is elsewhere now."""

from __future__ import annotations

import re
from collections.abc import Set
from typing import NamedTuple

from anim.caches.source_document.bake_source import BakeSource
from anim.caches.source_document.expression_binds import lost_bind_notes
from anim.gltf.document import Json, json_array
from anim.gltf.validation import hierarchy
from anim.gltf.writing.unknown_extensions import extensions_naming_clips, possible_node_indices, unknown_extensions
from anim.units import list_some

_OF_NODE = re.compile(r"/nodes/([0-9]{1,18})/extensions/[^/]*")


class _Changes(NamedTuple):
    """Nodes that a bake changes.

    emptied: without their mesh now. left: without it, or without a mesh that was below them.
    """

    emptied: Set[int]
    left: Set[int]


def reference_notes(source: BakeSource, after: Json) -> tuple[str, ...]:
    """Return notes on expressions without morph targets, and on unknown extensions that may name what is changed.

    Those that are known are changed with what they name. after: JSON of the bake.
    """
    before = source.document.json
    changes = _changes(before, after)
    several = max(source.num_clips, len(json_array(before, "animations"))) > 1  # one of them stays, as the first
    places = {place for place, part in unknown_extensions(before) if _is_affected(place, part, changes)}
    places.update(extensions_naming_clips(before) if several else ())
    lost = lost_bind_notes(before, after)
    if not places:
        return lost
    return (*lost, f"extensions may name a clip or mesh by the index of another one now: {list_some(sorted(places))}")


def _changes(before: Json, after: Json) -> _Changes:
    old, new = json_array(before, "nodes"), json_array(after, "nodes")
    above, now_above = hierarchy.parents(before), hierarchy.parents(after)
    meshes = [i for i, node in enumerate(old) if "mesh" in node]
    emptied = {i for i in meshes if "mesh" not in new[i]}
    left = set(emptied)
    for node in meshes:
        parent = above[node] if node in emptied or above[node] != now_above[node] else -1
        while parent >= 0 and parent not in left:
            left.add(parent)
            parent = above[parent]
    return _Changes(emptied, left)


def _is_affected(place: str, extension: object, changes: _Changes) -> bool:
    """True if an extension may name a node without its mesh now, or belongs to a node that a mesh has left."""
    node = _OF_NODE.fullmatch(place)
    if node is not None and int(node[1]) in changes.left:
        return True
    return not changes.emptied.isdisjoint(possible_node_indices(extension))
