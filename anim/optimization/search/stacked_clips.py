"""Source motions of several clips as one, so that their trials are played and measured together.

Arrays over time are padded to the longest clip: a shorter one repeats its last time, which changes no maximum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import matrix
from anim.measure.error.point_matrix import PointMatrix
from anim.measure.error.point_rows import stack_points
from anim.model import Skeleton
from anim.model.skeleton import nearest_at_or_above
from anim.optimization.search.playback import level_world_matrices, required_levels
from anim.optimization.search.source_motion import PATHS, ROTATION, SourceMotion

END_WEIGHT = 4.0  # weight of the first and the last time in fits: loops and cuts must stay continuous
BLOCK_VALUES = 1 << 20  # of nodes, compared at a time: 8 MB


class StackedClips:
    """B clips with W times each, and their T tracks, one clip after the other.

    at: (B, W) s, measurement times. grid: (B, G) s, possible key times. on_grid: (B, G) their indices in `at`. before:
    (B, W) index of the grid's time at or before each. weights: (B, W) of the times in fits, 0 after a clip's last one.
    first_track: (B + 1,) of each clip's tracks. clip, node, path: (T,) of each track, the last two indices of nodes and
    in PATHS. moving: (M,) nodes with tracks. row: (T,) of each node among them. local: translation (3, M, B, W),
    rotation (4, M, B, W), scale (3, M, B, W) of these nodes. varying: (V,) nodes above points that other tracks move.
    varying_matrices: (V, 4, 3, B, W) columns of their local matrices. varying_rotation: (4, V, B, W). constant,
    constant_matrices, constant_rotation: the same of nodes that stay, without clips and times. points: of all clips, on
    nodes that move in their parents' space, or are roots. levels: of the points' nodes. columns: (4 J, 3, B, W) of
    their world matrices; by_chord: the same with nlerp, which differs in the clips `bent`. sources: without world
    matrices.
    """

    def __init__(self, skeleton: Skeleton, sources: Sequence[SourceMotion], points: PointMatrix) -> None:
        self._num_nodes = len(skeleton)
        # without what is large for long clips
        self.sources = [replace(source, world=source.world[:0], chords=None) for source in sources]
        moving = [each for source in sources for each in source.moving]
        counts = [len(source.moving) for source in sources]
        self.first_track = np.cumsum([0, *counts])
        self.clip = np.repeat(np.arange(len(sources)), counts)
        self.node = np.array([each.node for each in moving], np.int64)
        self.path = np.array([PATHS.index(each.path) for each in moving], np.int64)
        lengths = [len(source.at) for source in sources]
        places = np.minimum(np.arange(max(lengths)), np.array(lengths)[:, None] - 1)
        pairs = list(zip(sources, places, strict=True))
        self.at = np.stack([source.at[times] for source, times in pairs])
        grids = [len(source.grid) for source in sources]
        some = np.minimum(np.arange(max(grids)), np.array(grids)[:, None] - 1)
        self.grid = np.stack([source.grid[times] for source, times in zip(sources, some, strict=True)])
        self.on_grid = np.stack([source.on_grid[times] for source, times in zip(sources, some, strict=True)])
        self.before = np.stack([np.searchsorted(each.grid, each.at[times], side="right") - 1 for each, times in pairs])
        self.weights = (np.arange(self.at.shape[1]) < np.array(lengths)[:, None]).astype(np.float64)
        self.weights[:, 0] = self.weights[np.arange(len(sources)), np.array(lengths) - 1] = END_WEIGHT
        self.moving, self.row = np.unique(self.node, return_inverse=True)
        self.local = tuple(self._padded(sources, path, self.moving) for path in range(len(PATHS)))
        needed = np.zeros(len(skeleton), np.bool_)
        needed[np.concatenate(required_levels(skeleton, points.nodes) or [self.moving])] = True
        needed[self.moving] = False
        others = np.flatnonzero(needed)
        is_still = _are_constant(sources, others)
        self.varying, self.constant = others[~is_still], others[is_still]
        varying = [self._padded(sources, path, self.varying) for path in range(len(PATHS))]
        self.varying_rotation = varying[ROTATION]
        self.varying_matrices = _local_matrices(skeleton, varying, self.varying)
        constant = [part[self.constant, :1].transpose(2, 0, 1)[..., None] for part in sources[0].local]
        self.constant_rotation = constant[ROTATION]
        self.constant_matrices = _local_matrices(skeleton, constant, self.constant)[..., 0, 0]
        self.points, self.levels = _rebind(points, skeleton, self.constant, self.constant_matrices)
        self.columns = self._columns([source.world for source in sources])
        self.by_chord = self.columns
        self.bent = frozenset(n for n, source in enumerate(sources) if source.chords is not None)
        if self.bent:
            self.by_chord = self._columns([_chord_world(skeleton, source, self.levels) for source in sources])

    @property
    def rotation(self) -> Floats:
        """Rotations (4, N, B, W) of all nodes; 0 of those that are neither moving nor above a point."""
        found = np.zeros((4, self._num_nodes, *self.at.shape))
        found[:, self.constant] = self.constant_rotation
        found[:, self.varying], found[:, self.moving] = self.varying_rotation, self.local[ROTATION]
        return found

    def _padded(self, sources: Sequence[SourceMotion], path: int, nodes: Ints) -> Floats:
        """Values (C, n, B, W) of some nodes in all clips."""
        result = np.empty((sources[0].local[path].shape[2], len(nodes), *self.at.shape))
        for b, source in enumerate(sources):
            count = len(source.at)
            result[:, :, b, :count] = np.moveaxis(source.local[path], 2, 0)[:, nodes]
            result[:, :, b, count:] = result[:, :, b, count - 1 : count]
        return result

    def _columns(self, worlds: Sequence[Floats]) -> Floats:
        """Columns (4 J, 3, B, W) from world matrices (N, W', 3, 4) of each clip."""
        nodes = self.points.nodes
        result = np.empty((4 * len(nodes), 3, len(worlds), self.at.shape[1]))
        for b, world in enumerate(worlds):
            count = world.shape[1]
            result[:, :, b, :count] = stack_points(world, nodes).reshape(-1, 3, count)
            result[:, :, b, count:] = result[:, :, b, count - 1 : count]
        return result


def take_clips(values: Floats, clips: Ints, axis: int) -> Floats:
    """Return the values of some clips (increasing, each once), which lie along an axis; no copy if those of all."""
    return values if len(clips) == values.shape[axis] else np.take(values, clips, axis=axis)


def _chord_world(skeleton: Skeleton, source: SourceMotion, levels: Sequence[Ints]) -> Floats:
    if source.chords is None:
        return source.world
    return level_world_matrices(skeleton, (source.local[0], source.chords, source.local[2]), levels)


def _local_matrices(skeleton: Skeleton, local: Sequence[Floats], nodes: Ints) -> Floats:
    """Columns (n, 4, 3, B, W) of the local matrices of some nodes, from translation, rotation, scale (C, n, B, W)."""
    shape = local[0].shape[1:]
    frames = shape[1] * shape[2]
    found = matrix.from_trs(*(np.moveaxis(part.reshape(len(part), shape[0], frames), 0, 2) for part in local))
    chosen = np.zeros(len(skeleton), np.bool_)
    chosen[nodes] = True
    inside = chosen[skeleton.sheared]
    found[np.searchsorted(nodes, skeleton.sheared[inside])] = skeleton.sheared_local[inside, None]
    columns: Floats = found.transpose(0, 3, 2, 1)
    return columns.reshape(shape[0], 4, 3, *shape[1:])


def _rebind(
    points: PointMatrix, skeleton: Skeleton, constant: Ints, matrices: Floats
) -> tuple[PointMatrix, tuple[Ints, ...]]:
    """The points on their nearest nodes that move in their parents' space, or are roots: fewer world matrices.

    constant: (S,) nodes that never move there. matrices: (S, 4, 3), columns of their local ones. Returned with the
    levels of the points' nodes.
    """
    moves = np.ones(len(skeleton), np.bool_)
    moves[constant] = False
    moves[skeleton.parents < 0] = True
    local = np.zeros((len(skeleton), 3, 4))
    local[constant] = np.swapaxes(matrices, 1, 2)
    local[moves] = np.eye(4)[:3]
    offsets = matrix.accumulate_from_tops(local, np.where(moves, -1, skeleton.parents), skeleton.levels())
    points = points.rebind(nearest_at_or_above(skeleton.parents, moves), offsets)
    return points, required_levels(skeleton, points.nodes)


def _are_constant(sources: Sequence[SourceMotion], nodes: Ints) -> Bools:
    """Mask (n,) of nodes whose local transform is the same at all times of all clips."""
    found: Bools = np.ones(len(nodes), np.bool_)
    for part, start in ((part, sources[0].local[i]) for each in sources for i, part in enumerate(each.local)):
        step = max(BLOCK_VALUES // max(part[0].size, 1), 1) if len(part) else 1
        for first in range(0, len(nodes), step):
            some = nodes[first : first + step]
            found[first : first + step] &= (part[some] == start[some, :1]).all(axis=(1, 2))
    return found
