"""World-space compensation: rotations that correct the errors of their ancestors.

The error of a joint's rotation moves all its descendants. If the joints below target their source orientation in the
world instead of their own source values, under parents as players will show them, the error only moves the next
joints: the moment arm of a hip is the thigh and no longer the whole leg, so that upper joints allow coarser storage.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints, unique_sorted
from anim.maths import quaternion
from anim.measure.error.point_matrix import PointMatrix
from anim.model import Skeleton
from anim.optimization.search import playback
from anim.optimization.search.keyed_tracks import KeyedAxes, KeyedTracks, StoredTracks
from anim.optimization.search.playback import level_world_matrices, required_levels
from anim.optimization.search.source_motion import PROBE_FRAMES, ROTATION, SourceMotion
from anim.optimization.search.stacked_clips import StackedClips, take_clips

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])[:, None, None, None]
CONJUGATE = np.array([-1.0, -1.0, -1.0, 1.0])[:, None, None]
MAX_BUDGET_GAIN = 20.0  # ratio of the moment arm to the compensated one


@dataclass(frozen=True, slots=True)
class _Level:
    """Nodes (n,) of one depth, their parents (n,), and their rotation tracks (n, B) in each clip; −1 for none."""

    nodes: Ints
    parents: Ints
    tracks: Ints


class ParentCompensation:
    """Computes keys level by level, from the roots down to the last rotation tracks, of several clips."""

    def __init__(self, skeleton: Skeleton, clips: StackedClips, keyed: KeyedTracks) -> None:
        self._keyed = keyed
        self._clips = clips
        self._own = clips.rotation
        tracks = np.full((len(skeleton), len(clips.sources)), -1)
        turning = np.flatnonzero(clips.path == ROTATION)
        tracks[clips.node[turning], clips.clip[turning]] = turning
        needed = np.zeros(len(skeleton), np.bool_)
        for nodes in required_levels(skeleton, unique_sorted(clips.node[turning])):
            needed[nodes] = True
        chosen = [nodes[needed[nodes]] for nodes in clips.levels]
        self._levels = [_Level(nodes, skeleton.parents[nodes], tracks[nodes]) for nodes in chosen if len(nodes)]
        self._true = np.empty_like(self._own)
        for level, above in self._descending(self._true):
            self._true[:, level.nodes] = _multiply(above, playback.normalize(self._own[:, level.nodes]))

    def follow(self, axes: KeyedAxes, tolerances: Floats, shown: Floats, clips: Ints) -> Iterator[StoredTracks]:
        """Yield all rotations on axes, level by level.

        Writes the played values of each to `shown` (4, M, b, W), of the `clips` (b,).
        tolerances: (T,) for storage, in units of values. shown: rotations, before it those of tracks without an axis.
        """
        axis_of = np.append(axes.axis_of, -1)  # for nodes without a track
        true, own = (take_clips(part, clips, 2) for part in (self._true, self._own))
        rotation = own.copy()
        rotation[:, self._clips.moving] = shown
        world = np.empty_like(rotation)
        for level, above in self._descending(world):
            tracks = level.tracks[:, clips]
            on_axis = np.nonzero(axis_of[tracks] >= 0)
            for here, clip in ([each[part] for each in on_axis] for part in self._keyed.parts(len(on_axis[0]))):
                nodes = level.nodes[here]
                targets = _targets(above[:, here, clip], true[:, nodes, clip], own[:, nodes, clip])
                found = self._keyed.store(tracks[here, clip], targets, axes, tolerances)
                rotation[:, nodes, clip] = shown[:, self._clips.row[found.tracks], clip] = found.shown
                yield found
            world[:, level.nodes] = _multiply(above, playback.normalize(rotation[:, level.nodes]))

    def _descending(self, world: Floats) -> Iterator[tuple[_Level, Floats]]:
        """Every level with the world rotations (4, n, b, W) of its nodes' parents, which callers fill in before."""
        for depth, level in enumerate(self._levels):
            if depth:
                yield level, world[:, level.parents]
            else:
                yield level, np.broadcast_to(IDENTITY, (4, len(level.nodes), *world.shape[2:]))


def _targets(above: Floats, true: Floats, own: Floats) -> Floats:
    """Local rotations (4, n, W) that restore the world orientations `true` under parents (4, n, W), signs as `own`."""
    targets = _multiply(above * CONJUGATE, true)
    return np.where(playback.dot(targets, own) < 0, -targets, targets)


def _multiply(a: Floats, b: Floats) -> Floats:
    """The products of quaternions (4, ...)."""
    return np.moveaxis(quaternion.multiply(np.moveaxis(a, 0, -1), np.moveaxis(b, 0, -1)), -1, 0)


def budget_gain(skeleton: Skeleton, source: SourceMotion, points: PointMatrix) -> Floats:
    """Return the ratio of each track's moment arm to the compensated one (G,); 1 except for rotations.

    The compensated arm ends at the next animated rotation below; points bound above that are not compensated.
    """
    turning = {each.node: i for i, each in enumerate(source.moving) if each.path == "rotation"}
    nth = max(1, -(-len(source.at) // PROBE_FRAMES))
    levels = required_levels(skeleton, points.nodes)
    world = level_world_matrices(skeleton, [part[:, ::nth] for part in source.local], levels)
    turner = np.full(len(skeleton) + 1, -1)  # nearest rotated ancestor; the last entry is for "no parent"
    reach = np.zeros(len(skeleton))
    for level in levels:
        turner[level] = turner[skeleton.parents[level]]
        for node in (node for node in level.tolist() if node in turning):
            if turner[node] >= 0:
                away = np.linalg.norm(world[node, :, :, 3] - world[turner[node], :, :, 3], axis=-1).max()
                reach[turner[node]] = max(reach[turner[node]], away)
            turner[node] = node
    carriers = turner[points.nodes[points.joints[np.arange(len(points)), points.factors[..., 3].argmax(axis=1)]]]
    mine = np.flatnonzero(carriers >= 0)
    away = np.linalg.norm(points.places(world)[mine] - world[carriers[mine], :, :, 3], axis=-1).max(axis=1)
    np.maximum.at(reach, carriers[mine], away)
    shorter = np.ones(len(source.moving))
    for node, i in turning.items():
        shorter[i] = np.clip(source.moving[i].meters / max(2 * reach[node], 1e-30), 1, MAX_BUDGET_GAIN)
    return shorter
