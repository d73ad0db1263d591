"""Bound usage of played clips: the largest error of each point, and of each track's rotation."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix, quaternion
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
        # nodes above points, level after level, so that each level is one slice of the arrays
        order = np.concatenate(clips.levels) if clips.levels else np.empty(0, np.int64)
        place = np.full(len(skeleton) + 1, -1)  # the last one for "no parent"
        place[order] = np.arange(len(order))
        ends = np.cumsum([0, *map(len, clips.levels)]).tolist()
        self._levels = [np.arange(*each) for each in pairwise(ends)]
        self._parents = place[skeleton.parents[order]]
        self._point_places = place[clips.points.nodes]
        self._moving = np.flatnonzero(place[clips.moving] >= 0)
        self._moving_places = place[clips.moving[self._moving]]
        varying, constant = (np.flatnonzero(place[nodes] >= 0) for nodes in (clips.varying, clips.constant))
        self._varying_places, self._constant_places = place[clips.varying[varying]], place[clips.constant[constant]]
        self._varying_matrices, self._constant_matrices = (
            clips.varying_matrices[varying],
            clips.constant_matrices[constant],
        )

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
        count = max(_block_times(len(self._skeleton)) // len(clips), 2)
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
        change = world[self._point_places].reshape(-1, 3 * at.size)
        change -= take_clips(columns[..., times], clips, 2).reshape(change.shape)
        most, gaps = self._bounds.max_speed_error, np.maximum(np.diff(at), MIN_INTERVAL_S).astype(np.float32)
        usage = np.empty((len(self._clips.points), len(at)))
        for rows, some in self._rows.blocks(change):
            moved = some.reshape(-1, 3, *at.shape)  # (P', 3, b, W)
            speeds = 0.0 if most is None or not gaps.size else _longest(np.diff(moved, axis=3) / gaps) / most
            usage[rows] = np.maximum(_longest(moved) / self._allowed[rows][:, clips], speeds)
        return usage

    def _world(self, shown: Sequence[Floats], times: slice, clips: Ints) -> Floats:
        """Columns (n, 4, 3, b · W) of the world matrices of nodes above points; only those with tracks are composed."""
        parts = [part[:, self._moving] for part in shown]
        frames = parts[0].shape[2] * parts[0].shape[3]
        moving = matrix.from_trs(*(np.moveaxis(part.reshape(*part.shape[:2], frames), 0, 2) for part in parts))
        local = np.empty((len(self._parents), 4, 3, frames))
        varying = take_clips(self._varying_matrices[..., times], clips, 3)
        local[self._varying_places] = varying.reshape(*varying.shape[:3], frames)
        local[self._constant_places] = self._constant_matrices[..., None]
        local[self._moving_places] = moving.transpose(0, 3, 2, 1)
        world = matrix.accumulate_world(local.transpose(0, 3, 2, 1), self._parents, self._levels, in_place=True)
        return world.transpose(0, 3, 2, 1)


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
