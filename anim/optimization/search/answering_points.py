"""The points that each node moves, by depth-first positions: no mask of all points for every node."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths.hierarchy import find_subtrees
from anim.measure.error.point_matrix import CARRIED, PointMatrix

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
        return np.array([values[self.of(node)].max(initial=0.0) for node in nodes], np.float64)

    def _find(self, first: int, end: int) -> Ints:
        some = slice(*np.searchsorted(self._sorted, (first, end)))
        near = self._point[some]
        if self._joint.shape[1] > 1:
            near = np.unique(near)
        joint = self._joint[near]
        share = (self._weight[near] * ((first <= joint) & (joint < end))).sum(axis=1)
        return np.asarray(near[share > CARRIED if (share > CARRIED).any() else share > 0])
