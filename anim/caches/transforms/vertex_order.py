"""Reorder the vertices of a cache, or remove unused ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from anim.arrays import Ints
from anim.errors import RangeError
from anim.model import FrameChunk, MeshPart, VertexCache

ORDERS = ("file", "blender")


def reorder(cache: VertexCache, order: str) -> VertexCache:
    """Return the cache with vertices in the order of the file, or of Blender's glTF importer.

    Blender removes vertices that no triangle of a primitive uses and keeps the others in ascending order, primitive by
    primitive. Raises RangeError for another order.
    """
    if order not in ORDERS:
        raise RangeError(f"`order` is '{order}' (expected file or blender)")
    return cache if order == "file" else _only_used(cache)


def _only_used(cache: VertexCache) -> VertexCache:
    is_kept = np.zeros(cache.vertex_count, bool)
    is_kept[cache.faces.reshape(-1)] = True
    for part in cache.parts:
        if part.faces[0] == part.faces[1]:  # points and lines, which the importer keeps too
            is_kept[slice(*part.vertices)] = True
    if is_kept.all() or not is_kept.any():
        return cache
    kept = np.flatnonzero(is_kept)
    places: Ints = np.cumsum(is_kept) - 1
    ends = np.concatenate(([0], np.cumsum(is_kept)))
    parts = tuple(replace(p, vertices=(int(ends[p.vertices[0]]), int(ends[p.vertices[1]]))) for p in cache.parts)
    return _taken(cache, kept, places[cache.faces], parts)


def _taken(cache: VertexCache, kept: Ints, faces: Ints, parts: tuple[MeshPart, ...]) -> VertexCache:
    def chunks() -> Iterator[FrameChunk]:
        for chunk in cache.chunks():
            yield chunk.changed(lambda rows: rows[:, kept])

    rest, handedness = (None if each is None else each[kept] for each in (cache.rest, cache.handedness))
    count = len(kept)
    return replace(cache, vertex_count=count, faces=faces, chunks=chunks, rest=rest, parts=parts, handedness=handedness)
