"""Materials of a document on the faces of a baked cache."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import groupby

import numpy as np

from anim.arrays import Floats
from anim.errors import AnimError
from anim.gltf.document import Document, Json, json_array
from anim.gltf.io.buffers import Resolve
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.materials import Material, image_data, read_materials
from anim.gltf.reading.vertex_colors import VertexColors, no_vertex_colors, read_vertex_colors, vertex_count
from anim.model import MeshPart, VertexCache
from anim.show.filmstrip import palette
from anim.show.filmstrip.surface import OPAQUE, Coating, Surface
from anim.show.filmstrip.texture import PixelBudget, Texels, TextureSampler, decode_image


class MaterialReader:
    """Reader of the surfaces of a document; images are decoded once. note: called with notes, a line each.

    resolve: gives the bytes of a companion file by its relative path; None for input without a folder.
    """

    def __init__(self, document: Document, resolve: Resolve | None, note: Callable[[str], None]) -> None:
        self._document, self._resolve, self._note = document, resolve, note
        self._accessors = Accessors(document)
        self._materials = read_materials(document, note)
        self._images: dict[object, Texels | None] = {}
        self._pixels = PixelBudget()
        self._read: dict[str, VertexColors] = {}
        self._coatings: dict[tuple[int, bool], Coating] = {}

    def surface(self, cache: VertexCache) -> tuple[Surface, Floats]:
        """Return the materials on a cache of the document, and the base colors (T, 3) multiplied by them."""
        texcoords, colors = np.zeros((cache.vertex_count, 2)), np.ones((cache.vertex_count, 4))
        coating = np.zeros(len(cache.faces), np.int64)
        coatings: dict[Coating, int] = {}
        painted: set[int] = set()
        for i, (part, found) in enumerate(self._primitives(cache)):
            vertices = slice(*part.vertices)
            texcoords[vertices], colors[vertices] = found.texcoords, found.colors
            key = (part.material, found.has_texcoords)
            if key not in self._coatings:
                self._coatings[key] = self._coating(self._material(part.material), textured=found.has_texcoords)
            made = self._coatings[key]
            if made.texture is not None or found.has_colors:
                painted.add(i)
            coating[slice(*part.faces)] = coatings.setdefault(made, len(coatings))
        factors = [material.factor[:3] for material in self._materials]
        has_colors = bool((colors != 1).any())
        surface = Surface(cache.faces, coating, tuple(coatings), texcoords, colors if has_colors else None)
        return surface, palette.face_colors(cache, factors, painted)

    def _primitives(self, cache: VertexCache) -> Iterator[tuple[MeshPart, VertexColors]]:
        """Yield the parts of a cache with their colors, without empty primitives."""
        nodes, meshes = json_array(self._document.json, "nodes"), json_array(self._document.json, "meshes")
        for node, parts in groupby(cache.parts, key=lambda part: part.node):
            mesh = nodes[node]["mesh"]
            numbered = iter(enumerate(meshes[mesh]["primitives"]))
            for part in parts:
                index, primitive = next(each for each in numbered if vertex_count(each[1], self._accessors))
                where = f"mesh {mesh}: primitive {index}"
                if where not in self._read:
                    self._read[where] = self._vertex_colors(primitive, self._material(part.material), where)
                yield part, self._read[where]

    def _vertex_colors(self, primitive: Json, material: Material, where: str) -> VertexColors:
        try:
            found = read_vertex_colors(self._document, primitive, self._accessors, material.texture)
        except AnimError as error:
            self._note(f"{error.at(where, ': ')}: drawn without texture and vertex colors")
            return no_vertex_colors(vertex_count(primitive, self._accessors))
        if found.has_colors and found.has_texcoords and _is_black(found.colors):
            self._note(f"{where}: most vertex colors are black, so they are taken for other data and not drawn")
            return replace(found, colors=np.ones_like(found.colors), has_colors=False)
        return found

    def _material(self, index: int) -> Material:
        return self._materials[index] if 0 <= index < len(self._materials) else Material()

    def _coating(self, material: Material, *, textured: bool) -> Coating:
        cutoff = {"MASK": material.alpha_cutoff, "BLEND": None}.get(material.alpha_mode, OPAQUE)
        texture = material.texture
        texels = self._image(texture.image) if texture is not None and textured else None
        if texture is None or texels is None:
            return Coating(None, material.factor[3], cutoff)
        return Coating(TextureSampler(texels, texture.wrap, texture.nearest), material.factor[3], cutoff)

    def _image(self, index: int) -> Texels | None:
        image = json_array(self._document.json, "images")[index]
        source = image.get("bufferView", image.get("uri"))  # several images of a file may share it
        if source not in self._images:
            try:
                data = image_data(self._document, index, self._accessors, self._resolve)
                self._images[source] = decode_image(data, self._pixels)
            except AnimError as error:
                self._note(f"{error.at(f'image {index}', ': ')}: drawn without it")
                self._images[source] = None
        return self._images[source]


def _is_black(colors: Floats) -> bool:
    """Return whether most vertices are black: masks of a game, which would hide the texture."""
    return bool(np.median(colors[:, :3].max(axis=1)) == 0)
