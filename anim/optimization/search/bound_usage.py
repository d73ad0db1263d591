"""Bound usage of played clips: the largest error of each point, and of each track's rotation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix, quaternion
from anim.measure.error.point_matrix import stack_points
from anim.model import Skeleton
from anim.optimization.options import Bounds
from anim.optimization.search.source_motion import ROTATION
from anim.optimization.search.stacked_clips import StackedClips, take_clips

MIN_INTERVAL_S = 1e-4  # s; minimum time step of a speed
MAX_BLOCK_MATRICES = 100_000  # world matrices of nodes at a time: 10 MB; more are measured in blocks of times
MIN_BLOCK_TIMES = 64


class BoundUsage:
    """Measures some of B clips, played as translation (3, M, b, W), rotation (4, M, b, W), scale (3, M, b, W).

    All are of the M nodes with tracks.

    allowed: (P, B) m, error bound of each point in each clip. bounds: those on angles and speeds count.
    """

    def __init__(self, skeleton: Skeleton, clips: StackedClips, allowed: Floats, bounds: Bounds) -> None:
        self._skeleton = skeleton
        self._clips = clips
        self._rows = clips.points.rows()
        self._allowed = allowed
        self._bounds = bounds

    def slerp_raw(self, shown: Sequence[Floats], clips: Ints) -> Floats:
        """Return the bound usage (P, b) of each point in `clips` (b,), for players with slerp."""
        return self._usage(shown, self._clips.columns, clips)

    def nlerp(self, shown: Sequence[Floats], clips: Ints) -> Floats:
        """Return the same for players with component-wise interpolation, against the source played by them."""
        return self._usage(shown, self._clips.by_chord, clips)

    def own(self, shown: Sequence[Floats], clips: Ints) -> list[Floats]:
        """Return the fraction of the angle bound that each track (G,) of each clip uses: errors of ancestors add up."""
        first, skeleton = self._clips.first_track, self._skeleton
        own = [np.zeros(first[clip + 1] - first[clip]) for clip in clips.tolist()]
        if self._bounds.max_angle is None:
            return own
        pair = (np.moveaxis(each, 0, 3) for each in (shown[ROTATION], self._clips.local[ROTATION][:, :, clips]))
        turned = np.zeros((len(skeleton), len(clips)))
        turned[self._clips.moving] = quaternion.angle_between(*pair).max(axis=2)
        for level in self._clips.levels[1:]:
            turned[level] += turned[skeleton.parents[level]]
        for level in reversed(self._clips.levels[1:]):
            np.maximum.at(turned, skeleton.parents[level], turned[level])
        for b, clip in enumerate(clips.tolist()):
            some = slice(first[clip], first[clip + 1])
            turning = self._clips.path[some] == ROTATION
            own[b][turning] = turned[self._clips.node[some][turning], b] / self._bounds.max_angle
        return own

    def _usage(self, shown: Sequence[Floats], columns: Floats, clips: Ints) -> Floats:
        count = max(_block_times(len(self._skeleton)) // len(clips), MIN_BLOCK_TIMES)
        length = self._clips.at.shape[1]
        if length <= count:
            return self._usage_over(slice(None), shown, columns, clips)
        # each block has one time of the block before, from which speeds are measured
        blocks = [slice(max(first - 1, 0), first + count) for first in range(0, length, count)]
        found = [self._usage_over(times, shown, columns, clips) for times in blocks]
        return np.asarray(np.max(found, axis=0))

    def _usage_over(self, times: slice, shown: Sequence[Floats], columns: Floats, clips: Ints) -> Floats:
        """The bound usage at some of the measurement times."""
        at = self._clips.at[clips, times]
        world = self._world([part[..., times] for part in shown], times, clips)
        change = stack_points(world, self._clips.points.nodes)
        change -= take_clips(columns[..., times], clips, 2).reshape(change.shape)
        most, gaps = self._bounds.max_speed_error, np.maximum(np.diff(at), MIN_INTERVAL_S).astype(np.float32)
        usage = np.empty((len(self._clips.points), len(at)))
        for rows, some in self._rows.blocks(change):
            moved = some.reshape(-1, 3, *at.shape)  # (P', 3, b, W)
            speeds = 0.0 if most is None or not gaps.size else _longest(np.diff(moved, axis=3) / gaps) / most
            usage[rows] = np.maximum(_longest(moved) / self._allowed[rows][:, clips], speeds)
        return usage

    def _world(self, shown: Sequence[Floats], times: slice, clips: Ints) -> Floats:
        """World matrices (N, b · W, 3, 4); only nodes with tracks get new local matrices."""
        moving = matrix.from_trs(*(np.moveaxis(part.reshape(*part.shape[:2], -1), 0, 2) for part in shown))
        local = np.empty((len(self._skeleton), 4, 3, moving.shape[1]))
        still = take_clips(self._clips.still_matrices[..., times], clips, 3)
        local[self._clips.still] = still.reshape(*still.shape[:3], moving.shape[1])
        local[self._clips.moving] = moving.transpose(0, 3, 2, 1)
        return matrix.accumulate_world(local.transpose(0, 3, 2, 1), self._skeleton.parents, list(self._clips.levels))


def _block_times(nodes: int) -> int:
    """The times of one block, of all clips."""
    return max(MAX_BLOCK_MATRICES // max(nodes, 1), MIN_BLOCK_TIMES)


def _longest(moved: Floats) -> Floats:
    """The longest (P, b) of vectors (P, 3, b, F), which are squared in place."""
    moved *= moved
    squares = moved[:, 0]
    squares += moved[:, 1]
    squares += moved[:, 2]
    return np.asarray(np.sqrt(squares.max(axis=2)))
