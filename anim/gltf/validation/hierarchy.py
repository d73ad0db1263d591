"""Check that nodes form a forest, and that skins and animation targets fit them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np

from anim.arrays import Ints
from anim.errors import FormatError
from anim.gltf.document import Json, json_array


def parents(json: Json) -> list[int]:
    """Return each node's parent, −1 for roots. Raises FormatError for a second parent or a cycle."""
    listed = [node.get("children", ()) for node in json_array(json, "nodes")]
    children = list(chain.from_iterable(listed))
    parent = np.full(len(listed), -1)
    parent[children] = np.repeat(np.arange(len(listed)), list(map(len, listed)))
    if np.count_nonzero(parent >= 0) < len(children):
        raise _second_parent(listed)
    _check_forest(parent)
    found: list[int] = parent.tolist()
    return found


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


def _second_parent(listed: Sequence[Sequence[int]]) -> FormatError:
    """The error of the first child that is listed twice. listed: the children of each node."""
    parent: dict[int, int] = {}
    for i, children in enumerate(listed):
        for child in children:
            if child in parent:
                return FormatError(f"has two parents ({parent[child]} and {i})", where=f"nodes[{child}]")
            parent[child] = i
    raise ValueError("no child has two parents")


def _check_forest(parent: Ints) -> None:
    """Raise FormatError for a cycle. Each step looks twice as far up: a path longer than all nodes has no end."""
    above = parent
    for _ in range(len(parent).bit_length()):
        if not (above >= 0).any():
            return
        above = np.where(above >= 0, above[above], -1)
    if (lost := np.flatnonzero(above >= 0)).size:
        raise FormatError("lies on a cycle (expected trees)", where=f"nodes[{int(lost[0])}]")
