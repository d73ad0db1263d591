"""Nodes with morph targets, and the pointers of KHR_animation_pointer to their weights."""

from __future__ import annotations

import re
from dataclasses import dataclass

_POINTER = re.compile(r"/(nodes|meshes)/(0|[1-9][0-9]{0,8})/weights(?:/(0|[1-9][0-9]{0,8}))?")


@dataclass(frozen=True, slots=True)
class MorphedNode:
    """Node with a mesh that has morph targets.

    node, mesh: indices in the file. weights: (M,) at rest. has_own: whether these are the node's, which replace those
    of the mesh, animated or not.
    """

    node: int
    mesh: int
    weights: tuple[float, ...]
    has_own: bool


@dataclass(frozen=True, slots=True)
class WeightPointer:
    """Target of a pointer to morph weights. owner: "nodes" or "meshes". target: one morph target, None for all."""

    owner: str
    index: int
    target: int | None


def parse_weight_pointer(pointer: str | None) -> WeightPointer | None:
    """Return the target of a pointer to morph weights; None for another pointer.

    parse_weight_pointer("/meshes/3/weights/1") → ("meshes", 3, 1)
    """
    match = _POINTER.fullmatch(pointer or "")
    if match is None:
        return None
    return WeightPointer(match[1], int(match[2]), None if match[3] is None else int(match[3]))
