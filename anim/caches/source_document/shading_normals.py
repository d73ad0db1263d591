"""Normals of a cache that has none, by the smooth and hard edges of its source."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from anim.arrays import AnyArray, Ints
from anim.caches.source_document.bake_source import baked_meshes
from anim.caches.source_document.lit_meshes import has_lit_normals
from anim.gltf.document import Document
from anim.gltf.reading.accessors import Accessors
from anim.model import FrameChunk, VertexCache
from anim.skinning.vertex_normals import SmoothNormals

UP = (0.0, 1.0, 0.0)  # of vertices without faces: a normal must be unit


def with_shading_normals(cache: VertexCache, document: Document) -> VertexCache:
    """Return the cache with area-weighted normals if its source has lit normals and it has none.

    Vertices with the same position and the same normal in the source share one, so that seams of texture coordinates
    stay invisible.
    """
    if cache.has_normals or not has_lit_normals(document.json, [each.node for each in baked_meshes(cache, document)]):
        return cache
    group = _groups(cache, document)
    first = np.unique(group, return_index=True)[1]
    normals = SmoothNormals(group[cache.faces], len(first))

    def chunks() -> Iterator[FrameChunk]:
        for chunk in cache.chunks():
            found = np.zeros((len(chunk.positions), len(first), 3), np.float32)
            normals.of(np.ascontiguousarray(chunk.positions[:, first], np.float32), found)
            found[~found.any(axis=2)] = UP
            yield replace(chunk, normals=found[:, group])

    return replace(cache, chunks=chunks, has_normals=True)


def _groups(cache: VertexCache, document: Document) -> Ints:
    """Index of the group (V,) of equal position and normal in the source, within one mesh."""
    accessors, json = Accessors(document), document.json
    found = np.arange(cache.vertex_count)
    for each in baked_meshes(cache, document):
        rows: list[AnyArray] = []
        for primitive in json["meshes"][each.mesh]["primitives"]:
            attributes = primitive["attributes"]
            if "POSITION" in attributes:
                positions = accessors.floats(attributes["POSITION"])
                zeros = np.zeros(positions.shape)
                normals = accessors.floats(attributes["NORMAL"]) if "NORMAL" in attributes else zeros
                rows.append(np.concatenate((positions, normals), axis=1))
        vertices = np.concatenate(rows)
        shared = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
        found[slice(*each.vertices)] = each.vertices[0] + shared[1][shared[2].reshape(-1)]
    return np.unique(found, return_inverse=True)[1].reshape(-1).astype(np.int64)
