"""Points, edges and hinges of a cloth mesh: vertices at one place are one point, however materials split them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import NotFoundError


@dataclass(frozen=True, slots=True, eq=False)
class ClothTopology:
    """Mesh of P points.

    point_of_vertex: (V,) index of the point of each vertex. first_vertex: (P,) a vertex of each point. faces: (T, 3)
    points. edges: (E, 2) points; hinges: (H, 2), the far points of two faces with a common edge. Both are ordered so
    that neighbors in the list share no point: a sweep over them then converges faster.
    """

    point_of_vertex: Ints
    first_vertex: Ints
    faces: Ints
    edges: Ints
    hinges: Ints


def build_topology(positions: Floats, faces: Ints, tolerance: float) -> ClothTopology:
    """Return the topology of vertices (V, 3) and faces (T, 3).

    tolerance: m, below which vertices are at one place. Raises NotFoundError for a mesh without edges.
    """
    cells = np.round(positions / max(tolerance, 1e-30)).astype(np.int64)
    _, first, point_of = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")  # points in the order of their first vertices
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    points = rank[point_of.reshape(-1)]
    welded = points[faces]
    distinct = (welded[:, 0] != welded[:, 1]) & (welded[:, 1] != welded[:, 2]) & (welded[:, 2] != welded[:, 0])
    welded = welded[distinct]
    if not len(welded):
        raise NotFoundError("the mesh has no edges: cloth needs triangles")
    edges, hinges = _edges_and_hinges(welded)
    count = len(first)
    edges, hinges = edges[color_order(edges, count)], hinges[color_order(hinges, count)]
    return ClothTopology(points, first[order], welded, np.ascontiguousarray(edges), np.ascontiguousarray(hinges))


def _edges_and_hinges(faces: Ints) -> tuple[Ints, Ints]:
    """Unique edges (E, 2), and far corners (H, 2) of the first two faces at every inner edge."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    far = np.concatenate([faces[:, 2], faces[:, 0], faces[:, 1]])
    sides = np.sort(sides, axis=1)
    order = np.lexsort((sides[:, 1], sides[:, 0]))
    sides, far = sides[order], far[order]
    is_first = np.append(True, (sides[1:] != sides[:-1]).any(axis=1))
    twins = np.flatnonzero(is_first[:-1] & ~is_first[1:])
    hinges = np.stack([far[twins], far[twins + 1]], axis=1)
    return sides[is_first], hinges[hinges[:, 0] != hinges[:, 1]]


def color_order(pairs: Ints, count: int) -> Ints:
    """Return the order (E,) of pairs (E, 2) of `count` points by greedy colors: those of a color share no point."""
    used, colors = [0] * count, np.empty(len(pairs), np.int64)
    for k, (i, j) in enumerate(pairs.tolist()):
        taken = used[i] | used[j]
        lowest = ~taken & (taken + 1)  # the bit of the first free color: a point may have thousands of pairs
        colors[k] = lowest.bit_length() - 1
        used[i] |= lowest
        used[j] |= lowest
    return np.argsort(colors, kind="stable")
