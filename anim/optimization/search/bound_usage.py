"""Bound usage of a trial: errors of the sample points as fractions of their bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.maths import matrix, quaternion
from anim.measure.error.point_matrix import PointMatrix, stack_points
from anim.model import Skeleton
from anim.optimization.options import Bounds
from anim.optimization.search.source_motion import ROTATION, SourceMotion
from anim.sampling.pose import local_matrices

MIN_INTERVAL_S = 1e-4  # s; minimum time step of a speed


class BoundUsage:
    """Measures a clip played as translation (N, W, 3), rotation (N, W, 4), scale (N, W, 3) of all nodes.

    allowed: (P,) m, error bound of each point.
    """

    def __init__(
        self, skeleton: Skeleton, source: SourceMotion, points: PointMatrix, allowed: Floats, bounds: Bounds
    ) -> None:
        self.bounds = bounds
        self._skeleton = skeleton
        self._source = source
        self.points = points
        self._rows = points.rows()
        self._allowed = allowed
        self._local = local_matrices(skeleton, source.local)
        self._changing = np.unique([each.node for each in source.moving]).astype(np.int64)
        self._nodes = np.array([each.node for each in source.moving], np.int64)
        self._turning = np.array([each.path == "rotation" for each in source.moving], np.bool_)

    def slerp_raw(self, shown: Sequence[Floats]) -> Floats:
        """Return the bound usage of each point (P,) for players with slerp."""
        return self._usage(shown, self._source.columns)

    def nlerp(self, shown: Sequence[Floats]) -> Floats:
        """Return the same for players with component-wise interpolation, against the source played by them."""
        return self._usage(shown, self._source.by_chord)

    def own(self, shown: Sequence[Floats]) -> Floats:
        """Return the fraction of the angle bound that each track (G,) uses: errors of all ancestors add up."""
        own = np.zeros(len(self._nodes))
        if self.bounds.max_angle is None:
            return own
        turned = quaternion.angle_between(shown[ROTATION], self._source.local[ROTATION]).max(axis=1)  # (N,)
        parents = self._skeleton.parents
        for level in self._source.levels[1:]:
            turned[level] += turned[parents[level]]
        for level in reversed(self._source.levels[1:]):
            np.maximum.at(turned, parents[level], turned[level])
        own[self._turning] = turned[self._nodes[self._turning]] / self.bounds.max_angle
        return own

    def _usage(self, shown: Sequence[Floats], columns: Floats) -> Floats:
        moved = self._rows.moves(stack_points(self._world(shown), self.points.nodes) - columns)
        usage = _longest(moved) / self._allowed
        if self.bounds.max_speed_error is not None and len(self._source.at) > 1:
            gaps = np.maximum(np.diff(self._source.at), MIN_INTERVAL_S).astype(np.float32)
            usage = np.maximum(usage, _longest(np.diff(moved, axis=2) / gaps) / self.bounds.max_speed_error)
        return np.asarray(usage, np.float64)

    def _world(self, shown: Sequence[Floats]) -> Floats:
        """World matrices (N, W, 3, 4); only nodes that a track may change get new local matrices."""
        local = self._local.copy()
        changing = self._changing
        local[changing] = matrix.from_trs(*(part[changing] for part in shown))
        return matrix.accumulate_world(local, self._skeleton.parents, list(self._source.levels))


def _longest(moved: Floats) -> Floats:
    """The longest of each row of vectors (P, 3, F)."""
    squares = moved * moved
    return np.asarray(np.sqrt((squares[:, 0] + squares[:, 1] + squares[:, 2]).max(axis=1)))
