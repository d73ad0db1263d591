"""The points that each node moves, by depth-first positions: no mask of all points for every node."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths.hierarchy import find_subtrees
from anim.measure.error.point_matrix import CARRIED, PointMatrix

MIN_OVERLAP = 16  # times that a point answers for a node, on average, from which on maxima of ranges are combined
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
        found = self._find(int(self._first[node]), int(self._end[node]))
        if len(found) <= self._room:
            self._room -= len(found)
            self._cached[node] = found
        return found

    def largest(self, values: Floats, nodes: Sequence[int]) -> Floats:
        """Return the largest of the values (P,), 0 or more, at the points of each node."""
        if self._is_nested:
            chosen = np.array(nodes, np.int64)
            starts, ends = np.searchsorted(self._sorted, (self._first[chosen], self._end[chosen]))
            if (ends - starts).sum() > MIN_OVERLAP * len(values):
                return _range_maxima(values[self._point], starts, ends)
        return np.array([values[self.of(node)].max(initial=0.0) for node in nodes], np.float64)

    def _find(self, first: int, end: int) -> Ints:
        some = slice(*np.searchsorted(self._sorted, (first, end)))
        near = self._point[some]
        if self._joint.shape[1] > 1:
            near = np.unique(near)
        joint = self._joint[near]
        share = (self._weight[near] * ((first <= joint) & (joint < end))).sum(axis=1)
        return np.asarray(near[share > CARRIED if (share > CARRIED).any() else share > 0])


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
