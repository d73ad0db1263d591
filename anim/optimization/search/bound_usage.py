"""What players show of one clip, judged: how far off it is, as shares of what it may be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.maths import matrix, quaternion
from anim.measure.error.point_matrix import PointMatrix, stack_points
from anim.model import Skeleton
from anim.optimization.options import Bounds
from anim.optimization.search.source_motion import ROTATION, SourceMotion
from anim.optimization.search.world_matrices import local_matrices

MIN_GAP_S = 1e-4  # s; speeds are not taken over less


class BoundUsage:
    """Judges a clip shown as translation (N, W, 3), rotation (N, W, 4) and scale (N, W, 3) of all nodes.

    allowed: (P,) m that each point may be off.
    """

    def __init__(
        self, skeleton: Skeleton, truth: SourceMotion, points: PointMatrix, allowed: Floats, bounds: Bounds
    ) -> None:
        self.bounds = bounds
        self._skeleton = skeleton
        self._truth = truth
        self.points = points
        self._rows = points.rows()
        self._allowed = allowed
        self._local = local_matrices(skeleton, truth.local)
        self._changing = np.unique([each.node for each in truth.moving]).astype(np.int64)
        self._nodes = np.array([each.node for each in truth.moving], np.int64)
        self._turning = np.array([each.path == "rotation" for each in truth.moving], np.bool_)

    def slerp_raw(self, shown: Sequence[Floats]) -> Floats:
        """Return the strain of each point (P,) where rotations run along arcs."""
        return self._usage(shown, self._truth.columns)

    def nlerp(self, shown: Sequence[Floats]) -> Floats:
        """Return the same against the truth as players show it that mix quaternions by components."""
        return self._usage(shown, self._truth.by_chord)

    def own(self, shown: Sequence[Floats]) -> Floats:
        """Return what share of the bound on angles each track (G,) takes: turns of all nodes above add up."""
        own = np.zeros(len(self._nodes))
        if self.bounds.max_angle is None:
            return own
        turned = quaternion.angle_between(shown[ROTATION], self._truth.local[ROTATION]).max(axis=1)  # (N,)
        parents = self._skeleton.parents
        for level in self._truth.levels[1:]:
            turned[level] += turned[parents[level]]
        for level in reversed(self._truth.levels[1:]):
            np.maximum.at(turned, parents[level], turned[level])
        own[self._turning] = turned[self._nodes[self._turning]] / self.bounds.max_angle
        return own

    def _usage(self, shown: Sequence[Floats], columns: Floats) -> Floats:
        moved = self._rows.moves(stack_points(self._world(shown), self.points.nodes) - columns)
        strain = _longest(moved) / self._allowed
        if self.bounds.max_speed_error is not None and len(self._truth.at) > 1:
            gaps = np.maximum(np.diff(self._truth.at), MIN_GAP_S).astype(np.float32)
            strain = np.maximum(strain, _longest(np.diff(moved, axis=2) / gaps) / self.bounds.max_speed_error)
        return np.asarray(strain, np.float64)

    def _world(self, shown: Sequence[Floats]) -> Floats:
        """World matrices (N, W, 3, 4): only nodes that a track may change need new local ones."""
        local = self._local.copy()
        changing = self._changing
        local[changing] = matrix.from_trs(*(part[changing] for part in shown))
        return matrix.accumulate_world(local, self._skeleton.parents, list(self._truth.levels))


def _longest(moved: Floats) -> Floats:
    """The longest of each row of vectors (P, 3, F)."""
    squares = moved * moved
    return np.asarray(np.sqrt((squares[:, 0] + squares[:, 1] + squares[:, 2]).max(axis=1)))
