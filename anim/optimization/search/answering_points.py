"""The points that each node moves, by depth-first positions: no mask of all points for every node."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import AnyArray, Floats, Ints, unique_sorted
from anim.maths.hierarchy import find_subtrees
from anim.measure.error.point_matrix import CARRIED, PointMatrix

MIN_OVERLAP = 16  # times that a point answers for a node, on average, from which on maxima of ranges are combined
BLOCK = 64  # points with one box
ROUNDING = 1 + 1e-12  # factor of a box's distance: no point of it is farther
MAX_CACHED = 10_000_000  # indices of points that are cached; those of further nodes are found again each time


class AnsweringPoints:
    """Points P bound to a node or its descendants with a noticeable weight; if none are, with any weight."""

    def __init__(self, points: PointMatrix, parents: Ints) -> None:
        """parents: (N,), of all nodes."""
        self._first, self._end = find_subtrees(parents)
        self._joint = self._first[points.nodes][points.joints]  # (P, I), positions in depth-first order
        self._weight = points.factors[..., 3]
        entries = self._joint.reshape(-1)
        order = np.argsort(entries, kind="stable")
        self._sorted, self._point = entries[order], order // max(self._joint.shape[1], 1)
        self._is_nested = self._joint.shape[1] == 1 and bool((self._weight > CARRIED).all())  # a range for each node
        self._cached: dict[int, Ints] = {}
        self._room = MAX_CACHED

    def of(self, node: int) -> Ints:
        """Return the indices of a node's points, in any order, each once."""
        if node in self._cached:
            return self._cached[node]
        if self._is_nested:
            start, end = np.searchsorted(self._sorted, (self._first[node], self._end[node]))
            return np.asarray(self._point[start:end])
        found = self._find(int(self._first[node]), int(self._end[node]))
        if len(found) <= self._room:
            self._room -= len(found)
            self._cached[node] = found
        return found

    def radii(self, places: AnyArray, nodes: Sequence[int], centers: AnyArray) -> Floats:
        """Return the largest distance of the points (P, 3, F) of each node (M,) from places of its own (M, 3, F), in m.

        0 without points.
        """
        if self._is_nested:
            starts, ends = self._ranges(nodes)
            if (ends - starts).sum() > MIN_OVERLAP * len(places):
                return np.sqrt(_farthest_in_ranges(places[self._point], starts, ends, centers))
        pairs = zip(nodes, centers, strict=True)
        return np.sqrt(np.array([_farthest(places[self.of(node)], center) for node, center in pairs], np.float64))

    def largest(self, values: Floats, nodes: Sequence[int]) -> Floats:
        """Return the largest of the values (P,), 0 or more, at the points of each node."""
        if self._is_nested:
            starts, ends = self._ranges(nodes)
            if (ends - starts).sum() > MIN_OVERLAP * len(values):
                return _range_maxima(values[self._point], starts, ends)
        return np.array([values[self.of(node)].max(initial=0.0) for node in nodes], np.float64)

    def _ranges(self, nodes: Sequence[int]) -> tuple[Ints, Ints]:
        """Start and end (M,) of each node's points in depth-first order."""
        chosen = np.array(nodes, np.int64)
        starts, ends = np.searchsorted(self._sorted, (self._first[chosen], self._end[chosen]))
        return starts, ends

    def _find(self, first: int, end: int) -> Ints:
        some = slice(*np.searchsorted(self._sorted, (first, end)))
        near = self._point[some]
        if self._joint.shape[1] > 1:
            near = unique_sorted(near)
        joint = self._joint[near]
        share = (self._weight[near] * ((first <= joint) & (joint < end))).sum(axis=1)
        return np.asarray(near[share > CARRIED if (share > CARRIED).any() else share > 0])


def _farthest(places: AnyArray, center: AnyArray) -> float:
    """The largest squared distance of places (V, 3, F) from one (3, F); 0 without any."""
    away = places - center
    away *= away
    return float((away[:, 0] + away[:, 1] + away[:, 2]).max(initial=0.0))


def _farthest_in_ranges(places: AnyArray, starts: Ints, ends: Ints, centers: AnyArray) -> Floats:
    """The largest squared distance (M,) of each range of places (P, 3, F) from one of M places (3, F).

    Blocks of places are only looked into if a corner of their box is farther than what was found.
    """
    edges = np.arange(0, len(places), BLOCK)
    low, high = (each.reduceat(places, edges, axis=0) for each in (np.minimum, np.maximum))
    found = np.zeros(len(starts))
    for i, (start, end, center) in enumerate(zip(starts.tolist(), ends.tolist(), centers, strict=True)):
        first, last = start // BLOCK, -(-end // BLOCK)
        corner = np.maximum(high[first:last] - center, center - low[first:last])
        corner *= corner
        reach = (corner[:, 0] + corner[:, 1] + corner[:, 2]).max(axis=1, initial=0.0) * ROUNDING
        farthest = 0.0
        for block in np.argsort(-reach).tolist():
            if reach[block] <= farthest:
                break
            here = BLOCK * (first + block)
            farthest = max(farthest, _farthest(places[max(here, start) : min(here + BLOCK, end)], center))
        found[i] = farthest
    return found


def _range_maxima(values: Floats, starts: Ints, ends: Ints) -> Floats:
    """The largest of the values (P,), 0 or more, in each range: of two that overlap, each of a power of two values."""
    found, lengths = np.zeros(len(starts)), ends - starts
    width = 1
    while len(some := np.flatnonzero(lengths >= width)):
        fits = some[lengths[some] < 2 * width]
        found[fits] = np.maximum(values[starts[fits]], values[ends[fits] - width])
        values = np.maximum(values[:-width], values[width:])
        width *= 2
    return found
