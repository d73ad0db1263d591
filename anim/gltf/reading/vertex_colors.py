"""Texture coordinates and colors of vertices, read only for rendering."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import FormatError
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.materials import Texture
from anim.gltf.validation.buffer_layout import DRACO


@dataclass(frozen=True, slots=True)
class VertexColors:
    """Colors of a primitive's vertices.

    texcoords: (V, 2) of the base color texture; zeros without any.
    colors: (V, 4) linear RGBA that multiply the base color; ones without any.
    """

    texcoords: Floats
    colors: Floats
    has_texcoords: bool
    has_colors: bool


def read_vertex_colors(
    document: Document, primitive: Json, accessors: Accessors, texture: Texture | None
) -> VertexColors:
    """Return COLOR_0 and the texture coordinates of a texture, transformed as it requires.

    Raises FormatError for a count other than the vertices', and the errors of `Accessors`.
    """
    attributes, count = primitive["attributes"], vertex_count(primitive, accessors)
    name = f"TEXCOORD_{texture.texcoord}" if texture is not None else ""
    found = no_vertex_colors(count)
    if not count or (name not in attributes and "COLOR_0" not in attributes):
        return found
    if DRACO in primitive.get("extensions", {}):
        from anim.gltf.reading import draco

        accessors, _ = draco.read_primitive(primitive, accessors, views=len(json_array(document.json, "bufferViews")))
    texcoords, colors = found.texcoords, found.colors
    if texture is not None and name in attributes:
        stored = _values(accessors, attributes[name], name, count, (2,))
        texcoords = stored @ texture.transform[:, :2].T + texture.transform[:, 2]
    if "COLOR_0" in attributes:
        stored = _values(accessors, attributes["COLOR_0"], "COLOR_0", count, (3, 4))
        colors[:, : stored.shape[1]] = np.clip(stored, 0, 1)
    return VertexColors(texcoords, colors, name in attributes, "COLOR_0" in attributes)


def no_vertex_colors(count: int) -> VertexColors:
    """Return the defaults of a primitive with `count` vertices: zeros and ones."""
    return VertexColors(np.zeros((count, 2)), np.ones((count, 4)), False, False)


def vertex_count(primitive: Json, accessors: Accessors) -> int:
    """Return the vertex count of a primitive, 0 without POSITION."""
    attributes = primitive["attributes"]
    return int(accessors.about(attributes["POSITION"])["count"]) if "POSITION" in attributes else 0


def _values(accessors: Accessors, index: int, name: str, count: int, widths: tuple[int, ...]) -> Floats:
    found = accessors.floats(index)
    if len(found) != count or found.shape[1] not in widths:
        raise FormatError(f"{name} has shape {found.shape} for {count} vertices")
    return found
