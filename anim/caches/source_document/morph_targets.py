"""Baked morph targets in the source document: its meshes with new vertices, and one clip of weights."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.caches.formats.morph_encoding import MAX_INT16, MorphEncoding
from anim.caches.source_document.bake_source import BakedMesh, BakeSource, Span, baked_meshes
from anim.caches.source_document.document_edit import DocumentEdit
from anim.caches.source_document.primitives import BakedVertices, baked_mesh
from anim.gltf.document import Document, Json
from anim.gltf.writing.append import VERTICES
from anim.gltf.writing.new_accessors import NewAccessors
from anim.model import VertexCache

QUANTIZATION = "KHR_mesh_quantization"


def replace_by_morphs(
    cache: VertexCache,
    form: MorphEncoding,
    normals: AnyArray | None,
    tangents: AnyArray | None,
    source: BakeSource,
    *,
    extras: Json,
    quantize: bool,
) -> Document:
    """Return the source document with morph targets in place of skins.

    normals, tangents: (1 + M, V, 3) of the base and of each target, or None. extras: of new nodes.
    quantize: targets as 16-bit integers.
    """
    meshes = baked_meshes(cache, source.document)
    edit = DocumentEdit.of(source, meshes)
    base = BakedVertices(
        form.base,
        None if normals is None else normals[0],
        None if tangents is None else tangents[0],
        cache.handedness,
    )
    node: Json = {"scale": [form.scale] * 3} if form.scale != 1 else {}
    if cache.up != "y":
        node["extras"] = extras
    weights = form.weights.astype("<f4")
    nodes = []
    for baked in meshes:
        targets = _targets(edit.new, source, baked, form, [normals, tangents], quantize=quantize)
        primitives = edit.primitives(baked, base, targets)
        mesh = baked_mesh(source.document.json, baked, primitives)
        if len(form.targets):
            mesh["weights"] = [float(weight) for weight in weights[0]]
        nodes.append(edit.place(baked, mesh, node))
    if len(form.targets) and len(form.frames) > 1:
        edit.animate(nodes, "weights", cache.times[form.frames], weights.reshape(-1, 1))
    if quantize and len(form.targets):
        edit.require(QUANTIZATION)
    return edit.document()


def _targets(
    new: NewAccessors,
    source: BakeSource,
    baked: BakedMesh,
    form: MorphEncoding,
    turned: list[AnyArray | None],
    *,
    quantize: bool,
) -> dict[Span, list[dict[str, int]]]:
    """Accessors of the targets of each primitive; directions only where the primitive had normals."""
    found: dict[Span, list[dict[str, int]]] = {}
    primitives = source.document.json["meshes"][baked.mesh]["primitives"]
    for span, primitive in zip(baked.spans, primitives, strict=True):
        has_normals = "NORMAL" in primitive["attributes"]
        rows = slice(*span)
        for i, target in enumerate(form.targets if span[0] < span[1] else ()):
            entry = {"POSITION": _displacements(new, target[rows], quantize=quantize)}
            for name, directions in zip(("NORMAL", "TANGENT"), turned, strict=True):
                if directions is not None and has_normals:
                    entry[name] = _displacements(new, directions[1 + i, rows], bounds=False)
            found.setdefault(span, []).append(entry)
    return found


def _displacements(new: NewAccessors, rows: AnyArray, *, quantize: bool = False, bounds: bool = True) -> int:
    if not quantize and not np.any(rows):
        return new.add_zeros(len(rows))
    stored: Floats | AnyArray = np.rint(rows * MAX_INT16).astype("<i2") if quantize else rows.astype("<f4")
    return new.add(stored, target=VERTICES, normalized=quantize, bounds=bounds)
