"""Texture coordinates and base colors of a source document for mesh files: OBJ with its .mtl, and PLY."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.caches.formats.texture_coordinates import texture_coordinates
from anim.caches.source_document.bake_source import baked_meshes
from anim.caches.storage import Outputs, companion_name
from anim.errors import FormatError
from anim.gltf.document import Document
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.materials import Material, image_data, read_materials
from anim.model import VertexCache

IMAGE_SUFFIXES = {b"\x89PNG": ".png", b"\xff\xd8\xff": ".jpg"}


@dataclass(frozen=True, slots=True)
class MeshMaterials:
    """Texture coordinates (V, 2), v from the bottom, and the material of each face (T,), −1 for none.

    library: file name of the .mtl, "" without one.
    """

    coordinates: AnyArray
    of_face: Ints
    library: str = ""


def mesh_materials(cache: VertexCache, document: Document, library: str) -> MeshMaterials:
    """Return the coordinates by which the base color of each vertex's material is looked up."""
    accessors, materials = Accessors(document), read_materials(document)
    rows: Floats = np.zeros((cache.vertex_count, 2))
    of_vertex = np.full(cache.vertex_count, -1)
    for each in baked_meshes(cache, document):
        for primitive, span in zip(document.json["meshes"][each.mesh]["primitives"], each.spans, strict=True):
            number = primitive.get("material")
            number = number if type(number) is int else -1
            texture = materials[number].texture if 0 <= number < len(materials) else None
            found = texture_coordinates(
                primitive, 0 if texture is None else texture.texcoord, accessors, span[1] - span[0]
            )
            of_vertex[slice(*span)] = number
            if found is not None:
                if texture is not None:
                    found = found @ texture.transform[:, :2].T + texture.transform[:, 2]
                rows[slice(*span)] = np.stack((found[:, 0], 1 - found[:, 1]), axis=1)
    return MeshMaterials(rows.astype(np.float32), of_vertex[cache.faces[:, 0]], library)


def write_library(document: Document, outputs: Outputs, name: str) -> None:
    """Write a .mtl with the base colors of all materials, and their images beside it."""
    accessors = Accessors(document)
    lines, images = ["# gltf-anim"], dict[int, str]()
    for number, material in enumerate(read_materials(document)):
        red, green, blue, alpha = material.factor
        alpha = alpha if material.alpha_mode == "BLEND" else 1.0
        lines += [f"newmtl material{number}", f"Kd {red:.6g} {green:.6g} {blue:.6g}", f"d {alpha:.6g}"]
        image = _image(material, document, accessors, outputs, images)
        lines += [f"map_Kd {image}"] if image else []
    with outputs.create(name) as file:
        file.write(("\n".join(lines) + "\n").encode())


def _image(
    material: Material, document: Document, accessors: Accessors, outputs: Outputs, images: dict[int, str]
) -> str:
    """Name of the image file of a material, written on first use; "" without one."""
    if material.texture is None:
        return ""
    number = material.texture.image
    if number not in images:
        try:
            data = image_data(document, number, accessors).tobytes()
        except FormatError:
            return ""
        ending = next((each for magic, each in IMAGE_SUFFIXES.items() if data.startswith(magic)), "")
        images[number] = companion_name(outputs.main, f"-image{number}{ending}")
        with outputs.create(images[number]) as file:
            file.write(data)
    return images[number]
