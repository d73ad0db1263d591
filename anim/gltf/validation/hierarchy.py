"""Check that nodes form a forest, and that skins and animation targets fit them."""

from __future__ import annotations

from anim.errors import FormatError
from anim.gltf.document import Json, json_array


def parents(json: Json) -> list[int]:
    """Return each node's parent, −1 for roots. Raises FormatError for a second parent or a cycle."""
    nodes = json_array(json, "nodes")
    parent = [-1] * len(nodes)
    for i, node in enumerate(nodes):
        for child in node.get("children", ()):
            if parent[child] >= 0:
                raise FormatError(f"has two parents ({parent[child]} and {i})", where=f"nodes[{child}]")
            parent[child] = i
    _check_forest(nodes, parent)
    return parent


def check(json: Json) -> None:
    """Raise FormatError unless nodes form a forest and each skin's matrices match its joints."""
    parents(json)
    accessors = json_array(json, "accessors")
    for i, skin in enumerate(json_array(json, "skins")):
        if "inverseBindMatrices" not in skin:
            continue
        matrices = accessors[skin["inverseBindMatrices"]]
        where = f"skins[{i}].inverseBindMatrices"
        if matrices["type"] != "MAT4" or matrices["componentType"] != 5126:
            raise FormatError(
                f"accessor is {matrices['type']} of {matrices['componentType']} (expected MAT4 of 5126)", where=where
            )
        if matrices["count"] < len(skin["joints"]):
            raise FormatError(
                f"accessor has {matrices['count']} matrices for {len(skin['joints'])} joints", where=where
            )


def _check_forest(nodes: list[Json], parent: list[int]) -> None:
    reached = [i for i, above in enumerate(parent) if above < 0]
    for node in reached:  # grows during the loop
        reached.extend(nodes[node].get("children", ()))
    if len(reached) < len(nodes):
        lost = min(set(range(len(nodes))) - set(reached))
        raise FormatError("lies on a cycle (expected trees)", where=f"nodes[{lost}]")
