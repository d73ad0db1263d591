"""Winding of faces whose node mirrors them: players reverse it by the node, so that vertices in world space need it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Bools, Ints
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.meshes import TRIANGLE_FAN, TRIANGLE_STRIP, TRIANGLES
from anim.gltf.validation import hierarchy
from anim.gltf.writing.append import INDICES
from anim.gltf.writing.new_accessors import NewAccessors

MAX_UINT16_INDEX = 65534  # 65535 restarts a primitive


@dataclass(slots=True)
class ReversedFaces:
    """Primitives with reversed faces; those with the same indices have one accessor of them."""

    document: Document
    _made: dict[tuple[int | None, int, int], int] = field(default_factory=dict)

    def of(self, new: NewAccessors, primitive: Json, vertices: int) -> Json:
        """Return the primitive with the opposite winding; points and lines are unchanged."""
        mode = primitive.get("mode", TRIANGLES)
        if mode not in (TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN):
            return primitive
        key = primitive.get("indices"), mode, 0 if "indices" in primitive else vertices
        if key not in self._made:
            old = np.arange(vertices) if key[0] is None else Accessors(self.document).indices(key[0])[:, 0]
            rows = reversed_indices(old, mode)
            kind = "<u2" if vertices - 1 <= MAX_UINT16_INDEX else "<u4"
            self._made[key] = new.add(rows.astype(kind)[:, None], target=INDICES)
        return {**primitive, "indices": self._made[key]}


def reversed_indices(indices: Ints, mode: int) -> Ints:
    """Return indices (n,) of triangles, a strip or a fan for the same faces with the opposite winding."""
    if mode == TRIANGLES:
        whole = indices[: len(indices) // 3 * 3].reshape(-1, 3)
        return whole[:, [0, 2, 1]].reshape(-1)
    if mode == TRIANGLE_STRIP:
        return np.concatenate((indices[:1], indices))  # the winding of a strip alternates
    return np.concatenate((indices[:1], indices[:0:-1]))


def find_negative_determinants(json: Json) -> Bools:
    """Return the mask (N,) of nodes whose world matrix at rest has a negative determinant.

    In steps that look twice as far up each: a chain of N nodes takes log2(N) of them.
    """
    above = np.array(hierarchy.parents(json), np.int64)
    sign = np.array([_own_sign(node) for node in json_array(json, "nodes")])
    while len(some := np.flatnonzero(above >= 0)):
        sign[some] *= sign[above[some]]
        above[some] = above[above[some]]
    return np.asarray(sign < 0)


def _own_sign(node: Json) -> float:
    if "matrix" in node:
        return float(np.sign(np.linalg.det(np.reshape(node["matrix"], (4, 4))[:3, :3])))
    return math.prod(math.copysign(1.0, each) if each else 0.0 for each in node.get("scale", ()))
