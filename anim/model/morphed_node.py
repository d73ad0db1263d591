"""Nodes with morph targets, and the pointers of KHR_animation_pointer to their weights."""

from __future__ import annotations

import re
from typing import NamedTuple

_POINTER = r"/(nodes|meshes)/(0|[1-9][0-9]{0,8})/weights(?:/(0|[1-9][0-9]{0,8}))?"


class MorphedNode(NamedTuple):
    """Node with a mesh that has morph targets.

    node, mesh: indices in the file. weights: (M,) at rest. has_own: whether these are the node's, which replace those
    of the mesh, animated or not.
    """

    node: int
    mesh: int
    weights: tuple[float, ...]
    has_own: bool


class WeightPointer(NamedTuple):
    """Target of a pointer to morph weights.

    owner, owner_index: "nodes" or "meshes", and which. target: one morph target, None for all.
    """

    owner: str
    owner_index: int
    target: int | None


def parse_weight_pointer(pointer: str | None) -> WeightPointer | None:
    """Return the target of a pointer to morph weights; None for another pointer.

    parse_weight_pointer("/meshes/3/weights/1") → ("meshes", 3, 1)
    """
    match = re.fullmatch(_POINTER, pointer) if pointer else None
    if match is None:
        return None
    return WeightPointer(match[1], int(match[2]), None if match[3] is None else int(match[3]))
