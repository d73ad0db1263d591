"""Bound usage of played clips: the largest error of each point, and of each track's rotation."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from anim.arrays import MAX_SINGLE_M, AnyArray, Bools, Floats, Ints
from anim.maths import matrix, quaternion
from anim.model import Skeleton
from anim.optimization.options import Bounds
from anim.optimization.search.source_motion import ROTATION
from anim.optimization.search.stacked_clips import StackedClips, take_clips

MIN_INTERVAL_S = 1e-4  # s; minimum time step of a speed
MAX_BLOCK_MATRICES = 100_000  # world matrices of nodes at a time: 10 MB; more are measured in blocks of times
MIN_BLOCK_TIMES = 64
# A clip is measured in float32, in half the time, where its bounds are this many rounding errors of its positions.
MIN_ROUNDINGS = 4000
PROBE_TIMES = 8  # of a clip, at which the nodes between the roots and the points are looked at


class _SourceMatrices(NamedTuple):
    """Columns of matrices of the source in one type, as of `StackedClips`, of nodes above points only."""

    columns: AnyArray
    by_chord: AnyArray
    varying: AnyArray
    constant: AnyArray


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
        self._source = _SourceMatrices(
            clips.columns, clips.by_chord, clips.varying_matrices[varying], clips.constant_matrices[constant]
        )
        self._is_single = self._fits_single()

    def slerp_raw(self, shown: Sequence[Floats], clips: Ints) -> Floats:
        """Return the bound usage (P, b) of each point in `clips` (b,), for players with slerp."""
        return self._usage(shown, "columns", clips)

    def nlerp(self, shown: Sequence[Floats], clips: Ints) -> Floats:
        """Return the same for players with component-wise interpolation, against the source played by them."""
        return self._usage(shown, "by_chord", clips)

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

    def _fits_single(self) -> Bools:
        """Mask (B,) of the clips that may be measured in float32, by their own motion and bounds."""
        columns = np.abs(self._source.columns).max(axis=(1, 3), initial=0.0).reshape(-1, 4, len(self._clips.sources))
        farthest = np.abs(self._clips.points.factors[..., :3]).max(initial=0.0)
        reach = columns[:, :3].max(axis=(0, 1), initial=0.0) * farthest + columns[:, 3].max(axis=0, initial=0.0)
        reach = np.maximum(reach, self._farthest_nodes())
        smallest = self._allowed.min(axis=0, initial=np.inf)
        if self._bounds.max_speed_error is not None:
            smallest = np.minimum(smallest, self._bounds.max_speed_error * MIN_INTERVAL_S)
        is_above_rounding = smallest >= MIN_ROUNDINGS * np.finfo(np.float32).eps * reach
        return np.asarray(is_above_rounding & (reach < MAX_SINGLE_M))

    def _farthest_nodes(self) -> Floats:
        """The largest coordinate (B,) of the nodes above points, in m: of a far parent the point may be near again."""
        every = np.arange(len(self._clips.sources))
        times = slice(None, None, -(-self._clips.at.shape[1] // PROBE_TIMES))
        world = self._world([part[..., times] for part in self._clips.local], times, self._source, every)
        places = np.abs(world[:, 3]).reshape(len(world), 3, len(every), -1)
        return np.asarray(places.max(axis=(0, 1, 3), initial=0.0))

    @cached_property
    def _single_source(self) -> _SourceMatrices:
        return _SourceMatrices(*(each.astype(np.float32) for each in self._source))

    def _usage(self, shown: Sequence[Floats], name: str, clips: Ints) -> Floats:
        """The bound usage (P, b) against the columns `name` of the source."""
        usage = np.empty((len(self._clips.points), len(clips)))
        is_single = self._is_single[clips]
        for single in sorted(set(is_single.tolist())):
            some = np.flatnonzero(is_single == single)
            source = self._single_source if single else self._source
            parts = [take_clips(part, some, 2) for part in shown]
            usage[:, some] = self._usage_in_blocks(parts, source, getattr(source, name), clips[some])
        return usage

    def _usage_in_blocks(
        self, shown: Sequence[Floats], source: _SourceMatrices, columns: AnyArray, clips: Ints
    ) -> Floats:
        count = max(_block_times(len(self._skeleton)) // len(clips), 2)
        length = self._clips.at.shape[1]
        # each block has one time of the block before, from which speeds are measured
        blocks = [slice(max(first - 1, 0), first + count) for first in range(0, length, count)]
        found = [self._usage_over(times, shown, source, columns, clips) for times in blocks]
        return np.asarray(np.max(found, axis=0))

    def _usage_over(
        self, times: slice, shown: Sequence[Floats], source: _SourceMatrices, columns: AnyArray, clips: Ints
    ) -> Floats:
        """The bound usage at some of the measurement times."""
        at = self._clips.at[clips, times]
        world = self._world([part[..., times] for part in shown], times, source, clips)
        change = world[self._point_places].reshape(-1, 3 * at.size)
        change -= take_clips(columns[..., times], clips, 2).reshape(change.shape)
        most, gaps = self._bounds.max_speed_error, np.maximum(np.diff(at), MIN_INTERVAL_S).astype(np.float32)
        usage = np.empty((len(self._clips.points), len(at)))
        for rows, some in self._rows.blocks(change):
            moved = some.reshape(-1, 3, *at.shape)  # (P', 3, b, W)
            speeds: float | Floats = 0.0
            if most is not None and gaps.size:  # float32 has no number for the smallest bounds
                speeds = np.divide(_longest(np.diff(moved, axis=3) / gaps), most, dtype=np.float64)
            usage[rows] = np.maximum(_longest(moved) / self._allowed[rows][:, clips], speeds)
        return usage

    def _world(self, shown: Sequence[Floats], times: slice, source: _SourceMatrices, clips: Ints) -> AnyArray:
        """Columns (n, 4, 3, b · W) of the world matrices of nodes above points; only those with tracks are composed."""
        kind = source.columns.dtype
        parts = [part[:, self._moving].astype(kind, copy=False) for part in shown]
        frames = parts[0].shape[2] * parts[0].shape[3]
        moving = matrix.from_trs(*(np.moveaxis(part.reshape(*part.shape[:2], frames), 0, 2) for part in parts))
        local: NDArray[Any] = np.empty((len(self._parents), 4, 3, frames), kind)
        varying = take_clips(source.varying[..., times], clips, 3)
        local[self._varying_places] = varying.reshape(*varying.shape[:3], frames)
        local[self._constant_places] = source.constant[..., None]
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
