"""The points that each node moves, by depth-first positions: no mask of all points for every node."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.maths.hierarchy import find_subtrees
from anim.measure.error.point_matrix import CARRIED, PointMatrix

MIN_OVERLAP = 16  # times that a point answers for a node, on average, from which on maxima of ranges are combined
BLOCK = 64  # points with one box
ROUNDING = 1 + 1e-12  # factor of a box's distance: no point of it is farther


class AnsweringPoints:
    """Points P bound to a node or its descendants with a noticeable weight; if none are, with any weight.

    In depth-first order, those of a node are one range: what is noticeable at a node is so at all above it, so that a
    point is listed at the lowest nodes where it is; a node that has several of these below has it several times.
    """

    def __init__(self, points: PointMatrix, parents: Ints, subtrees: tuple[Ints, Ints] | None = None) -> None:
        """parents: (N,), of all nodes. subtrees: as of `find_subtrees`, if known. Weights are 0 or more."""
        self._first, self._end = find_subtrees(parents) if subtrees is None else subtrees
        joints, weights = self._first[points.nodes][points.joints], points.factors[..., 3]  # (P, I), positions
        self._noticeable = _PointList(*_lowest_carried(joints, weights, self._first, self._end, parents))
        point, influence = np.nonzero(weights > 0)
        self._any = _PointList(joints[point, influence], point)

    def radii(self, places: AnyArray, nodes: Sequence[int], centers: AnyArray) -> Floats:
        """Return the largest distance of the points (P, 3, F) of each node (M,) from places of its own (M, 3, F), in m.

        0 without points.
        """
        found = np.zeros(len(nodes))
        for listed, some, starts, ends in self._spans(nodes):
            if (ends - starts).sum() > MIN_OVERLAP * len(places):
                found[some] = _farthest_in_ranges(places[listed.point], starts, ends, centers[some])
            else:
                spans = zip(starts.tolist(), ends.tolist(), centers[some], strict=True)
                found[some] = [_farthest(places[listed.point[i:j]], center) for i, j, center in spans]
        return np.sqrt(found)

    def largest(self, values: Floats, nodes: Sequence[int]) -> Floats:
        """Return the largest of the values (P,), 0 or more, at the points of each node."""
        found = np.zeros(len(nodes))
        for listed, some, starts, ends in self._spans(nodes):
            if (ends - starts).sum() > MIN_OVERLAP * len(values):
                found[some] = _range_maxima(values[listed.point], starts, ends)
            else:
                spans = zip(starts.tolist(), ends.tolist(), strict=True)
                found[some] = [values[listed.point[i:j]].max(initial=0.0) for i, j in spans]
        return found

    def _spans(self, nodes: Sequence[int]) -> Iterator[tuple[_PointList, Ints, Ints, Ints]]:
        """Lists of points, the indices into `nodes` of those that have points there, and their ranges of the list."""
        chosen = np.array(nodes, np.int64)
        left = np.arange(len(chosen))
        for listed in (self._noticeable, self._any):
            starts, ends = listed.find_ranges(self._first[chosen[left]], self._end[chosen[left]])
            has = starts < ends
            yield listed, left[has], starts[has], ends[has]
            left = left[~has]


class _PointList:
    """Points in depth-first order of the nodes at which they are listed."""

    def __init__(self, at: Ints, point: Ints) -> None:
        """at: (E,), positions of nodes. point: (E,), indices of points."""
        order = np.argsort(at, kind="stable")
        self._at, self.point = at[order], point[order]

    def find_ranges(self, first: Any, end: Any) -> tuple[Any, Any]:
        """Start and end in `point` of what is listed at nodes from one position to before another."""
        return np.searchsorted(self._at, first), np.searchsorted(self._at, end)


def _lowest_carried(joints: Ints, weights: Floats, first: Ints, end: Ints, parents: Ints) -> tuple[Ints, Ints]:
    """Positions of nodes (E,) and points (E,): the lowest nodes with a noticeable weight of a point at and below them.

    joints, weights: (P, I), joints as positions. first, end: (N,), of subtrees. Some nodes above are listed too.
    """
    point, influence = np.nonzero(weights > CARRIED)
    at = joints[point, influence]
    faint = (weights > 0) & (weights <= CARRIED)  # noticeable together with others below the same node only
    some = np.flatnonzero(faint.sum(axis=1) > 1)
    if not len(some):
        return at, point
    own, share = joints[some], weights[some]
    places = np.sort(np.where(faint[some], own, len(first)), axis=1)
    row, place = np.nonzero(places[:, 1:] < len(first))  # nodes above several are those above two next to each other
    above = _lowest_common(places[row, place], places[row, place + 1], first, parents)
    row, above = row[above >= 0], above[above >= 0]
    last = np.empty_like(end)
    last[first] = end
    together = np.zeros(len(row))
    for i in range(joints.shape[1]):  # in their order: all at once would take memory
        together += share[row, i] * ((above <= own[row, i]) & (own[row, i] < last[above]))
    is_carried = together > CARRIED
    return np.append(at, above[is_carried]), np.append(point, some[row[is_carried]])


def _lowest_common(low: Ints, high: Ints, first: Ints, parents: Ints) -> Ints:
    """Positions (M,) of the lowest nodes with both of two at or below them; −1 for none.

    It is the first of the parents of all nodes after the one up to the other, in depth-first order.
    """
    above = np.empty_like(first)
    above[first] = np.where(parents >= 0, first[parents], -1)
    found = len(first) - 1 - _range_maxima(len(first) - 1 - above, low + 1, high + 1).astype(np.int64)
    return np.where(low == high, low, found)


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


def _range_maxima(values: AnyArray, starts: Ints, ends: Ints) -> Floats:
    """The largest of the values (P,), 0 or more, in each range: of two that overlap, each of a power of two values."""
    found, lengths = np.zeros(len(starts)), ends - starts
    width = 1
    while len(some := np.flatnonzero(lengths >= width)):
        fits = some[lengths[some] < 2 * width]
        found[fits] = np.maximum(values[starts[fits]], values[ends[fits] - width])
        values = np.maximum(values[:-width], values[width:])
        width *= 2
    return found
