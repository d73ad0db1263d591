"""Bounds of the displacement of morphed vertices and of its rate of change, per joint.

A displacement is A·p(w′) − B·p(w) = (A − B)·p(w) + A₃·Σ (w′ − w)·t with matrices A and B of the new and the old joint,
points p(w) = p + Σ w·t morphed by weights w, and A₃ without the translation. Each term is bounded by its largest length
over the boxes around p and t; the change from frame to frame is bounded in the same way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.measure.error.displacement import largest_over

SIDES = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])  # signs of a box's corners


class Change(NamedTuple):
    """Both versions over time: matrices `moved` = A − B and `after` = A (J, F, 3, 4), weights (F, M)."""

    moved: Floats
    after: Floats
    old: Floats
    new: Floats


class MorphBounds(NamedTuple):
    """Boxes of one surface.

    corners: (J, 8, 3) around the vertices of each joint. extents: (M, 3), the largest displacement of each target along
    each axis. share: the largest sum of skin weights of a vertex.
    """

    corners: Floats
    extents: Floats
    fraction: float

    def sizes(self, change: Change) -> Floats:
        """Return upper bounds of the displacement (J, F) of the vertices of each joint, in m."""
        bounds = largest_over(self._boxes(change), change.moved)
        return np.asarray(self.fraction * (bounds + _norm(change.after) * self._reach(change.new - change.old)))

    def rates(self, change: Change, step: Floats) -> Floats:
        """Return upper bounds of its rate of change from frame to frame (J, F − 1), in m/s. step: (F − 1,) s."""
        apart = change.new - change.old
        total = largest_over(self._boxes(change), np.diff(change.moved, axis=1))
        total += _norm(change.moved[:, :-1]) * self._reach(np.diff(change.old, axis=0))
        total += _norm(np.diff(change.after, axis=1)) * self._reach(apart[1:])
        total += _norm(change.after[:, :-1]) * self._reach(np.diff(apart, axis=0))
        return np.asarray(self.fraction * total / step)

    def _boxes(self, change: Change) -> Floats:
        """The corners, expanded by the largest displacement for the clips' weights."""
        most = np.maximum(np.abs(change.old), np.abs(change.new)).max(axis=0, initial=0.0)
        return np.asarray(self.corners + SIDES * (most @ self.extents))

    def _reach(self, weights: Floats) -> Floats:
        """Upper bound of the displacement (F,) by weights (F, M), in m of mesh space."""
        return np.asarray(np.linalg.norm(np.abs(weights) @ self.extents, axis=1))


def _norm(matrices: Floats) -> Floats:
    """Upper bounds (J, F) of the factor by which a vector gets longer."""
    return np.asarray(np.sqrt((matrices[..., :3] ** 2).sum(axis=(-1, -2))))
