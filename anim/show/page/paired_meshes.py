"""Meshes of two files whose vertices correspond one by one, for the heat of a page."""

from __future__ import annotations

from collections.abc import Iterable

from anim.caches.source_document.bake_source import baked_meshes
from anim.errors import RangeError
from anim.model import VertexCache
from anim.show.page.page import MeshNodes, PageFile

PairedMeshes = tuple[MeshNodes, MeshNodes]


def pair_cache_meshes(one: PageFile, other: PageFile) -> PairedMeshes:
    """Return the meshes of two files that correspond, of which one is a vertex cache; none if the vertices don't fit.

    A cache has the vertices of the file that it is a bake of, in the order of that file.
    """
    if other.cache is None:
        cached, document = pair_cache_meshes(other, one)
        return document, cached
    if one.cache is not None:
        return None, None
    nodes = _nodes_of(other.cache, one)
    return (nodes, None) if nodes else ((), ())


def pair_nodes(pairs: Iterable[tuple[int, int]]) -> PairedMeshes:
    """Return pairs of nodes as the meshes of each file."""
    found = tuple(pairs)
    return tuple(node for node, _ in found), tuple(node for _, node in found)


def _nodes_of(cache: VertexCache, file: PageFile) -> tuple[int, ...]:
    try:
        return tuple(each.node for each in baked_meshes(cache, file.document))
    except RangeError:
        return ()
