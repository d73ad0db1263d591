"""The rest mesh of a texture in its source document: with its materials, and look-ups in a free set of coordinates."""

from __future__ import annotations

from anim.arrays import AnyArray
from anim.caches.source_document.bake_source import BakedMesh, BakeSource, baked_meshes
from anim.caches.source_document.document_edit import DocumentEdit
from anim.caches.source_document.primitives import BakedVertices, baked_mesh
from anim.gltf.document import Document, Json
from anim.gltf.writing.append import VERTICES
from anim.model import VertexCache

MIN_LOOKUP_SET = 1  # the first set is that of base color in most tools


def free_coordinate_set(cache: VertexCache, document: Document) -> int:
    """Return the first set of texture coordinates, from 1 on, that no baked primitive has."""
    names = {
        name
        for each in baked_meshes(cache, document)
        for primitive in document.json["meshes"][each.mesh]["primitives"]
        for name in primitive["attributes"]
    }
    number = MIN_LOOKUP_SET
    while f"TEXCOORD_{number}" in names:
        number += 1
    return number


def place_lookup_mesh(
    cache: VertexCache, rest: AnyArray, normals: AnyArray | None, lookup: AnyArray, source: BakeSource
) -> Document:
    """Return the source document with the rest mesh in place of skins, without other meshes and animations.

    rest, normals: (V, 3). lookup: (V, 2), in all sets up to the free one that a primitive does not have.
    """
    document = source.document
    meshes = baked_meshes(cache, document)
    last = free_coordinate_set(cache, document)
    baked = {each.node for each in meshes}
    others = {i for i, node in enumerate(document.json["nodes"]) if "mesh" in node} - baked
    edit = DocumentEdit.of(BakeSource(document, left_out=frozenset(others)), meshes)
    vertices = BakedVertices(rest, normals, None, None)
    for each in meshes:
        primitives = edit.primitives(each, vertices, {})
        _add_lookup(edit, each, primitives, lookup, last)
        mesh = edit.add_mesh(baked_mesh(document.json, each, primitives), each.mesh)
        edit.place_new_node(each, {"mesh": mesh})
    return edit.document()


def _add_lookup(edit: DocumentEdit, baked: BakedMesh, primitives: list[Json], lookup: AnyArray, last: int) -> None:
    """Add the look-up to primitives, in place."""
    for primitive, span in zip(primitives, baked.spans, strict=True):
        if span[0] < span[1]:
            index = edit.new.add(lookup[slice(*span)].astype("<f4"), target=VERTICES)
            for number in range(last + 1):
                primitive["attributes"].setdefault(f"TEXCOORD_{number}", index)
