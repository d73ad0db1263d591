"""Source motions of several clips as one, so that their trials are played and measured together.

Arrays over time are padded to the longest clip: a shorter one repeats its last time, which changes no maximum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.measure.error.point_matrix import PointMatrix, stack_points
from anim.model import Skeleton
from anim.optimization.search.playback import level_world_matrices, required_levels
from anim.optimization.search.source_motion import PATHS, ROTATION, SourceMotion

END_WEIGHT = 4.0  # weight of the first and the last time in fits: loops and cuts must stay continuous


class StackedClips:
    """B clips with W times each, and their T tracks, one clip after the other.

    at: (B, W) s, measurement times. grid: (B, G) s, possible key times. on_grid: (B, G) their indices in `at`. before:
    (B, W) index of the grid's time at or before each. weights: (B, W) of the times in fits, 0 after a clip's last one.
    first_track: (B + 1,) of each clip's tracks. clip, node, path: (T,) of each track, the last two indices of nodes and
    in PATHS. moving: (M,) nodes with tracks. row: (T,) of each node among them. local: translation (3, M, B, W),
    rotation (4, M, B, W), scale (3, M, B, W) of these nodes. still: (S,) the other nodes. still_matrices:
    (S, 4, 3, B, W) columns of their local matrices. still_rotation: (4, S, B, W). points: of all clips, on nodes that
    move in their parents' space, or are roots. levels: of the points' nodes. columns: (4 J, 3, B, W) of their world
    matrices; by_chord: the same with nlerp.
    """

    def __init__(self, skeleton: Skeleton, sources: Sequence[SourceMotion], points: PointMatrix) -> None:
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
        self.still = np.setdiff1d(np.arange(len(skeleton)), self.moving)
        self.local = tuple(self._padded(sources, path, self.moving) for path in range(len(PATHS)))
        still = [self._padded(sources, path, self.still) for path in range(len(PATHS))]
        self.still_rotation = still[ROTATION]
        self.still_matrices = _local_matrices(skeleton, still, self.still)
        self.points, self.levels = _rebind(points, skeleton, self.still_matrices, self.still)
        self.columns = self._columns([source.world for source in sources])
        self.by_chord = self.columns
        if any(source.chords is not None for source in sources):
            self.by_chord = self._columns([_chord_world(skeleton, source, self.levels) for source in sources])

    @property
    def rotation(self) -> Floats:
        """Rotations (4, N, B, W) of all nodes."""
        found = np.empty((4, len(self.moving) + len(self.still), *self.at.shape))
        found[:, self.moving], found[:, self.still] = self.local[ROTATION], self.still_rotation
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
    found[np.isin(nodes, skeleton.sheared)] = skeleton.sheared_local[np.isin(skeleton.sheared, nodes)][:, None]
    columns: Floats = found.transpose(0, 3, 2, 1)
    return columns.reshape(shape[0], 4, 3, *shape[1:])


def _rebind(
    points: PointMatrix, skeleton: Skeleton, matrices: Floats, still: Ints
) -> tuple[PointMatrix, tuple[Ints, ...]]:
    """The points on their nearest nodes that move in their parents' space, or are free to, or are roots.

    Fewer world matrices are computed for them. still: (S,) nodes that are not free. matrices: (S, 4, 3, B, W), local
    ones of these. Returned with the levels of the points' nodes.
    """
    start = matrices[..., :1, :1]
    moves = np.ones(len(skeleton), np.bool_)
    moves[still] = (matrices != start).any(axis=(1, 2, 3, 4))
    local = np.zeros((len(skeleton), 3, 4))
    local[still] = np.swapaxes(start[..., 0, 0], 1, 2)
    nearest, offsets = np.arange(len(skeleton)), np.tile(np.eye(4)[:3], (len(skeleton), 1, 1))
    for level in required_levels(skeleton, points.nodes)[1:]:
        constant = level[~moves[level]]
        above = skeleton.parents[constant]
        nearest[constant] = nearest[above]
        offsets[constant] = matrix.multiply(offsets[above], local[constant])
    points = points.rebind(nearest, offsets)
    return points, required_levels(skeleton, points.nodes)
