"""Materials of the faces of a mesh that several primitives of a document became."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Ints
from anim.caches.source_document.bake_source import Span
from anim.caches.source_document.checked_materials import find_material
from anim.gltf.document import Json

DEFAULT_MATERIAL = -1  # glTF's, of primitives without one


class FaceMaterials(NamedTuple):
    """Indices of the materials that faces have, in order, and the faces of each.

    Empty if there are no faces, or none with a material of the document.
    """

    numbers: list[int]
    faces: list[Ints]


def face_materials(document: Json, faces: Ints, primitives: Sequence[tuple[Json, Span]]) -> FaceMaterials:
    """Return the materials of faces (T, 3). primitives: each with its vertices, in their order.

    Raises FormatError for a material that the document does not have.
    """
    used = [each.get("material", DEFAULT_MATERIAL) for each, _ in primitives]
    for number in used:
        find_material(document, number)
    if not len(faces) or set(used) <= {DEFAULT_MATERIAL}:
        return FaceMaterials([], [])
    starts = np.array([span[0] for _, span in primitives])
    of_face = np.array(used)[np.searchsorted(starts, faces[:, 0], side="right") - 1]
    order = np.argsort(of_face, kind="stable")
    numbers, firsts = np.unique(of_face[order], return_index=True)
    if numbers.tolist() == [DEFAULT_MATERIAL]:
        return FaceMaterials([], [])
    return FaceMaterials(numbers.tolist(), np.split(order, firsts[1:]))
