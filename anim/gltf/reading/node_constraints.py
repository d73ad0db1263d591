"""Nodes that players rotate after a clip by VRMC_node_constraint, and extensions that use the rest pose.

Constraints are not evaluated here. Source: VRMC_node_constraint 1.0, whose rotations are relative to the rest pose.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from anim.gltf.document import Json, json_array
from anim.gltf.validation import hierarchy
from anim.maths.hierarchy import with_ancestors

CONSTRAINT = "VRMC_node_constraint"
# A humanoid's clips, spring bones and constraints are relative to the rotations of the nodes at rest.
REST_POSE_EXTENSIONS = frozenset({"VRM", "VRMC_vrm", "VRMC_springBone", CONSTRAINT})


def constrained_nodes(json: Json) -> list[int]:
    """Return the indices of the nodes with a constraint."""
    nodes = enumerate(json_array(json, "nodes"))
    return [i for i, node in nodes if "extensions" in node and CONSTRAINT in (node["extensions"] or {})]


def constraint_sources(json: Json) -> frozenset[int]:
    """Return the nodes that move the constrained ones: sources, and of aim constraints both nodes with all above."""
    nodes = json_array(json, "nodes")
    found, aims = np.zeros(len(nodes), np.bool_), np.zeros(len(nodes), np.bool_)
    for node in constrained_nodes(json):
        for kind, source in _sources(nodes[node]["extensions"][CONSTRAINT]):
            if 0 <= source < len(nodes):
                found[source] = True
                if kind == "aim":
                    aims[[node, source]] = True
    if aims.any():
        found |= with_ancestors(np.array(hierarchy.parents(json)), aims)
    return frozenset(np.flatnonzero(found).tolist())


def rest_pose_extensions(json: Json) -> list[str]:
    """Return the names of the extensions of a file that are relative to its rest pose."""
    found = [name for name in json.get("extensionsUsed", ()) if name in REST_POSE_EXTENSIONS]
    return found or ([CONSTRAINT] if constrained_nodes(json) else [])


def _sources(extension: Any) -> list[tuple[str, int]]:
    """Kinds and sources of a constraint; its values are of any type, since nothing has checked them."""
    constraint = extension.get("constraint") if isinstance(extension, dict) else None
    kinds = constraint.items() if isinstance(constraint, dict) else ()
    found = [(kind, each.get("source")) for kind, each in kinds if isinstance(each, dict)]
    return [(kind, source) for kind, source in found if type(source) is int]
