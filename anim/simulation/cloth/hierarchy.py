"""Pairs of distant points on straight lines of edges: coarse levels by which constraints converge on any mesh.

A sweep over edges moves a disturbance by a few edges, so a fine mesh would need many. Limits between points 2, 4, 8 …
edges apart carry it across the mesh in one. They act only where the fabric is too long, and keep momentum.
Source: after Müller, Hierarchical Position Based Dynamics, 2008, with all points on every level.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Bools, Floats, Ints
from anim.simulation.cloth.tethers import PATH_TOLERANCE, find_flat_points, point_normals
from anim.simulation.cloth.topology import ClothTopology, color_order

MAX_RANGE_EDGES = 1024  # of a pair
MIN_COSINE = 0.2  # 78°, between an edge and the one that continues its line, such as across a pleat
FLAT_COSINE = 0.9998  # 1°, between normals at both ends of a line on a flat part of the mesh
MAX_PATH_PER_DISTANCE = 2.0  # lines that are more bent limit nothing


@dataclass(frozen=True, slots=True, eq=False)
class Hierarchy:
    """Limits between distant points, the coarsest level first.

    pairs: (D, 2) points, on each level in an order in which neighbors share no point; in 32 bits, since the solver
    reads 20 for each point. lengths: (D,) m, of the mesh between them. starts: (L + 1,) index of the first pair of
    each level.
    """

    pairs: NDArray[np.int32]
    lengths: Floats
    starts: Ints


def build_hierarchy(topology: ClothTopology, x: Floats, pinned: Bools) -> Hierarchy:
    """Return pairs of points (P, 3) that are 2, 4, 8 … edges apart on lines that continue edges.

    Lines end at pinned points (P,) and where no edge continues them within 78°.
    """
    edges, normals = topology.edges, point_normals(topology, x)
    flat_points = find_flat_points(topology, x, FLAT_COSINE)
    halves = np.concatenate([edges, edges[:, ::-1]])
    following = _continue_lines(halves, x, pinned)
    end, lengths = halves[:, 1].copy(), np.linalg.norm(x[halves[:, 1]] - x[halves[:, 0]], axis=1)
    is_flat = flat_points[halves].all(axis=1) & (_dot(normals[halves[:, 0]], normals[end]) > FLAT_COSINE)
    levels: list[tuple[Ints, Floats]] = []
    span = 1
    while span < MAX_RANGE_EDGES:
        then = np.flatnonzero(following >= 0)
        if not len(then):
            break
        rest = following[then]
        joined = lengths[then] + lengths[rest]
        flat = is_flat[then] & is_flat[rest] & (_dot(normals[halves[then, 0]], normals[end[rest]]) > FLAT_COSINE)
        farther, after = end[rest], following[rest]
        following, end = np.full(len(halves), -1), end.copy()
        following[then], end[then], lengths[then], is_flat[then] = after, farther, joined, flat
        levels.append(_pairs(halves[then, 0], farther, joined, flat, x, pinned))
        span *= 2
    levels = [level for level in levels[::-1] if len(level[0])]
    starts = np.cumsum([0, *(len(pairs) for pairs, _ in levels)])
    pairs = np.concatenate([np.zeros((0, 2), np.int32), *(pairs for pairs, _ in levels)])
    return Hierarchy(pairs, np.concatenate([np.zeros(0), *(lengths for _, lengths in levels)]), starts)


def _continue_lines(halves: Ints, x: Floats, pinned: Bools) -> Ints:
    """For each directed edge (H, 2) the one that goes on most straightly from its end, −1 for none: (H,)."""
    along = x[halves[:, 1]] - x[halves[:, 0]]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    order = np.argsort(halves[:, 0], kind="stable")
    first = np.searchsorted(halves[order, 0], np.arange(len(x) + 1))
    count = np.diff(first)
    found, best = np.full(len(halves), -1), np.full(len(halves), MIN_COSINE)
    for k in range(int(count.max(initial=0))):
        has = np.flatnonzero((count[halves[:, 1]] > k) & ~pinned[halves[:, 1]])
        candidate = order[first[halves[has, 1]] + k]
        cosine = _dot(along[has], along[candidate])
        better = cosine > best[has] + 1e-9
        found[has[better]], best[has[better]] = candidate[better], cosine[better]
    return found


def _pairs(a: Ints, b: Ints, lengths: Floats, flat: Bools, x: Floats, pinned: Bools) -> tuple[Ints, Floats]:
    """Unique pairs in the order of colors, and the length of each: straight where both mesh and line are."""
    straight = np.linalg.norm(x[a] - x[b], axis=1)
    chosen = (a != b) & ~(pinned[a] & pinned[b]) & (lengths <= MAX_PATH_PER_DISTANCE * straight)
    is_straight = flat & (lengths <= (1 + PATH_TOLERANCE) * straight)
    limits = np.where(is_straight, straight, lengths)[chosen]
    low, high = np.minimum(a, b)[chosen], np.maximum(a, b)[chosen]
    order = np.lexsort((limits, high, low))
    low, high, limits = low[order], high[order], limits[order]
    is_first = np.ones(len(low), bool)
    is_first[1:] = (np.diff(low) != 0) | (np.diff(high) != 0)
    pairs = np.stack([low[is_first], high[is_first]], axis=1)
    sweep = color_order(pairs, len(x))
    return np.ascontiguousarray(pairs[sweep], np.int32), limits[is_first][sweep]


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("hc,hc->h", a, b))
