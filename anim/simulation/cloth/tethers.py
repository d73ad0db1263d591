"""Distances of points to pinned ones along the mesh: limits that no motion of a fabric exceeds.

Source: Kim, Chentanez, Müller-Fischer, Long Range Attachments, 2012.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.simulation.cloth.topology import ClothTopology

PATH_TOLERANCE = 0.03  # of the lengths of paths along the mesh
FLAT_COSINE = 0.97  # about 14°, between the normals of a point and of its faces
NUM_COMMON_ANCHORS = 4  # pinned points far apart, beside the nearest: a sheet held at two corners needs both


def tether_lengths(topology: ClothTopology, x: Floats, pinned: Ints) -> tuple[Ints, Floats]:
    """Return for each point K pinned ones, −1 for none, and their distances along the mesh: (P, K), (P, K) m.

    The first is the nearest. The others are pinned points far from each other, the same for all points. Paths follow
    edges, and where the mesh is flat straight lines between points up to three edges apart, at most 3 % too long, but
    through no other pinned point; where one is no longer than that, the straight distance is taken.
    """
    if not len(pinned):
        return np.full((len(x), 1), -1), np.zeros((len(x), 1))
    is_pinned = np.zeros(len(x), bool)
    is_pinned[pinned] = True
    is_flat = find_flat_points(topology, x, FLAT_COSINE)
    anchors, lengths = _nearest(_neighborhoods(topology, x, np.ones(len(x), bool), is_flat), x, pinned)
    columns, limits = [anchors], [lengths]
    covered = np.full(len(pinned), np.inf)
    chosen = int(pinned[np.linalg.norm(x[pinned] - x[pinned].mean(axis=0), axis=1).argmax()])
    for _ in range(min(NUM_COMMON_ANCHORS, len(pinned))):
        usable = ~is_pinned
        usable[chosen] = True
        found, lengths = _nearest(_neighborhoods(topology, x, usable, is_flat), x, np.array([chosen]))
        columns.append(np.where(found == anchors, -1, found))
        limits.append(lengths)
        covered = np.minimum(covered, np.linalg.norm(x[pinned] - x[chosen], axis=1))
        chosen = int(pinned[covered.argmax()])
    return np.ascontiguousarray(np.stack(columns, axis=1)), np.ascontiguousarray(np.stack(limits, axis=1))


def order_outward(edges: Ints, distances: Floats) -> Ints:
    """Return the order (E,) of edges (E, 2) by the distances (P,) of their far ends from pinned points; stable."""
    a, b = distances[edges[:, 0]], distances[edges[:, 1]]
    return np.lexsort((np.minimum(a, b), np.maximum(a, b)))


def _neighborhoods(topology: ClothTopology, x: Floats, usable: Bools, is_flat: Bools) -> Any:
    """Sparse distances (P, P) of usable points (P,): along edges, and across up to three where all points are flat."""
    from scipy.sparse import coo_array

    def adjacency(chosen: Bools) -> Any:
        a, b = topology.edges[chosen[topology.edges].all(axis=1)].T
        near = coo_array((np.ones(len(a)), (a, b)), shape=(len(x), len(x))).tocsr()
        return near + near.T

    flat = adjacency(usable & is_flat)
    rings = (adjacency(usable) + flat @ flat + flat @ flat @ flat).tocoo()
    lengths = np.linalg.norm(x[rings.row] - x[rings.col], axis=1)
    ends = rings.row.astype(np.int32), rings.col.astype(np.int32)  # `dijkstra` of scipy 1.12 takes no others
    return coo_array((lengths, ends), shape=(len(x), len(x))).tocsr()


def find_flat_points(topology: ClothTopology, x: Floats, cosine: float) -> Bools:
    """Return True (P,) for points whose faces have nearly one normal. cosine: the least, to their mean."""
    points, repeated = topology.faces.ravel(), np.repeat(_face_normals(topology, x), 3, axis=0)
    mean = point_normals(topology, x)
    is_flat = np.ones(len(x), bool)
    is_flat[points[(repeated * mean[points]).sum(axis=1) < cosine]] = False
    return is_flat


def point_normals(topology: ClothTopology, x: Floats) -> Floats:
    """Return the unit normals (P, 3) of points, means of their faces'; 0 for points without faces."""
    points, repeated = topology.faces.ravel(), np.repeat(_face_normals(topology, x), 3, axis=0)
    return _unit(np.stack([np.bincount(points, repeated[:, c], minlength=len(x)) for c in range(3)], axis=1))


def _face_normals(topology: ClothTopology, x: Floats) -> Floats:
    corners = x[topology.faces]
    return _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300))


def _nearest(graph: Any, x: Floats, sources: Ints) -> tuple[Ints, Floats]:
    """For each point the nearest source, −1 if none is reached, and its distance: (P,), (P,) m."""
    from scipy.sparse.csgraph import dijkstra

    distance, _, source = dijkstra(graph, directed=False, indices=sources, min_only=True, return_predecessors=True)
    reached = np.isfinite(distance)
    anchors = np.where(reached, source, sources[0]).astype(np.int64)
    straight = np.linalg.norm(x - x[anchors], axis=1)
    lengths = np.where(distance <= (1 + PATH_TOLERANCE) * straight, straight, distance)
    return np.where(reached, anchors, -1), np.where(reached, lengths, 0.0)
