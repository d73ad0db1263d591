"""Texture coordinates of a primitive, for formats that store them for each vertex."""

from __future__ import annotations

from anim.arrays import Floats
from anim.errors import FormatError
from anim.gltf.document import Json
from anim.gltf.reading.accessors import Accessors


def texture_coordinates(primitive: Json, number: int, accessors: Accessors, count: int) -> Floats | None:
    """Return TEXCOORD_n (V, 2) of a primitive with `count` vertices; None if it has none.

    Raises FormatError for another shape, and the errors of `Accessors`.
    """
    name = f"TEXCOORD_{number}"
    index = primitive["attributes"].get(name)
    if index is None or not count:
        return None
    found = accessors.floats(index)
    if found.shape != (count, 2):
        raise FormatError(f"{name} has shape {found.shape} for {count} vertices")
    return found
