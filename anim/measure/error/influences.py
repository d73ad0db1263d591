"""Influences of joints on the vertices of a surface, grouped by joint: in O(N log N) of the influences.

Files have up to 65 535 joints, so that nothing is done per joint over all vertices.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.measure.error.morph_bounds import SIDES


class GroupedInfluences:
    """Vertices grouped by the joint with the largest weight.

    joints: (V, I) indices of joints below `num_joints`. weights: (V, I), those of 0 have no influence.
    main_joints: (G,) the joint of each group, ascending. groups: G arrays of vertices, ascending; those without
    influence are in none. reach: of each group the joints with influence, ascending.
    """

    def __init__(self, joints: Ints, weights: Floats, num_joints: int) -> None:
        self._joints, self._weights, self._num_joints = joints, weights, num_joints
        first = weights.argmax(axis=1)[:, None] if weights.size else np.zeros((len(weights), 1), np.int64)
        leader = np.take_along_axis(joints, first, axis=1)[:, 0] if weights.size else first[:, 0]
        self._order = np.argsort(leader, kind="stable")
        self._order = self._order[np.asarray(self._carrying.any(axis=1))[self._order]]
        first = _first_of_each(leader[self._order])
        self.main_joints = leader[self._order[first]].tolist()
        self.groups = np.split(self._order, first[1:]) if len(first) else []
        self._group = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(self._order))))
        pairs = np.sort(self._pairs[self._carrying[self._order]])
        self._reached = pairs[_first_of_each(pairs)]
        self._starts = np.searchsorted(self._reached, np.arange(len(first) + 1) * max(num_joints, 1))
        self.reach = np.split(self._reached % max(num_joints, 1), self._starts[1:-1]) if len(first) else []

    @cached_property
    def _carrying(self) -> Bools:
        return np.asarray(self._weights > 0)

    @property
    def _pairs(self) -> Ints:
        """(V', I), group and joint as one number, of the grouped vertices in order."""
        return np.asarray(self._group[:, None] * max(self._num_joints, 1) + self._joints[self._order])

    def products(self, points: Floats) -> list[Floats]:
        """Return of each group the factors of matrices (V_g, J_g · 4): weight times x, y, z, 1, per joint of its reach.

        points: (V, 3), or (V, I, 3) with those that each influence moves.
        """
        widths, sizes = np.diff(self._starts), np.array([len(each) for each in self.groups], np.int64)
        ends = np.cumsum(widths * sizes)
        rows = np.cumsum(widths[self._group]) - widths[self._group]  # where each vertex's factors start
        places = rows[:, None] + np.searchsorted(self._reached, self._pairs) - self._starts[self._group][:, None]
        carrying, weights = self._carrying[self._order], self._weights[self._order]
        ordered = points[self._order]
        whole = np.concatenate((ordered, np.ones((*ordered.shape[:-1], 1))), axis=-1)
        flat = np.zeros((int(ends[-1]) if len(ends) else 0, 4))
        for i in range(places.shape[1]):  # one influence of each vertex at a time: no place comes twice
            some = carrying[:, i]
            flat[places[some, i]] += weights[some, i, None] * (whole[some] if whole.ndim == 2 else whole[some, i])
        parts = np.split(flat, ends[:-1]) if len(ends) else []
        return [part.reshape(size, -1) for part, size in zip(parts, sizes.tolist(), strict=True)]

    def boxes(self, points: Floats) -> Floats:
        """Return the corners (J, 8, 3) of the box around the points with influence of each joint, which must have one.

        points: (V, 3), or (V, I, 3) with those that each influence moves.
        """
        vertices, places = np.nonzero(self._carrying)
        joints = self._joints[vertices, places]
        order = np.argsort(joints, kind="stable")
        first = _first_of_each(joints[order])
        if not len(first):
            return np.empty((0, len(SIDES), 3))
        chosen = points[vertices[order]] if points.ndim == 2 else points[vertices[order], places[order]]
        low, high = (each.reduceat(chosen, first, axis=0)[:, None] for each in (np.minimum, np.maximum))
        return np.where(SIDES < 0, low, high)


def _first_of_each(ordered: Ints) -> Ints:
    """Indices of the first of each value in an ascending array."""
    return np.flatnonzero(np.diff(ordered, prepend=ordered[:1] - 1))
