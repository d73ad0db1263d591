"""Rotations that make up for what the nodes above them show: each turns its node as it truly lies in the world.

What a joint's rotation is off carries all that hangs on it. Where the joints below aim at their true direction in the
world instead of their own true values, under parents as players will show them, it carries only the next joints: the
lever of a hip is the thigh and no longer the whole leg, so that upper joints may be stored far coarser.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import quaternion
from anim.measure.error.point_matrix import PointMatrix
from anim.model import Skeleton
from anim.optimization.search.candidates import Candidate, Candidates
from anim.optimization.search.source_motion import PROBE_FRAMES, SourceMotion
from anim.optimization.search.time_axes import SharedAxis
from anim.optimization.search.world_matrices import level_world_matrices

MAX_ANGLE_RAD = 20.0  # times that a lever may seem longer than what is left of it


@dataclass(frozen=True, slots=True)
class _Level:
    """Nodes (n,) of one depth, their parents (n,), and the tracks (n,) that turn them; −1 for none."""

    nodes: Ints
    parents: Ints
    tracks: Ints


class ParentCompensation:
    """Finds keys level by level, from the roots on."""

    def __init__(self, skeleton: Skeleton, truth: SourceMotion, candidates: Candidates) -> None:
        self._truth = truth
        self._candidates = candidates
        tracks = np.full(len(skeleton), -1)
        for i, each in enumerate(truth.moving):
            if each.path == "rotation":
                tracks[each.node] = i
        self._levels = [_Level(level, skeleton.parents[level], tracks[level]) for level in truth.levels]
        self._true = np.empty_like(truth.local[1])
        for level, above in self._descending(self._true):
            self._true[level.nodes] = quaternion.multiply(above, quaternion.normalize(truth.local[1][level.nodes]))

    def follow(
        self, axes: Sequence[SharedAxis], misses: Sequence[float], rotation: Floats
    ) -> Iterator[tuple[int, Candidate]]:
        """Return each rotation track on an axis with its candidate, and put what it shows into `rotation` (N, W, 4).

        misses: (G,) what storing may miss, in units of values. rotation: what is shown of tracks on no axis.
        """
        on = np.full(len(self._truth.moving) + 1, -1)  # the last stands for nodes without a track
        for number, axis in enumerate(axes):
            on[list(axis.members)] = number
        world = np.empty_like(rotation)
        for level, above in self._descending(world):
            axis_of = on[level.tracks]
            for number in np.unique(axis_of[axis_of >= 0]).tolist():
                here = np.flatnonzero(axis_of == number)
                nodes, members = level.nodes[here], level.tracks[here].tolist()
                found = self._candidates.compensated(axes[number], members, self._targets(nodes, above[here]), misses)
                for node, member, candidate in zip(nodes.tolist(), members, found, strict=True):
                    rotation[node] = candidate.shown
                    yield member, candidate
            world[level.nodes] = quaternion.multiply(above, quaternion.normalize(rotation[level.nodes]))

    def _descending(self, world: Floats) -> Iterator[tuple[_Level, Floats]]:
        """Every level with the world rotations (n, W, 4) of its nodes' parents, which must be there by then."""
        yield self._levels[0], np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(self._levels[0].nodes), *world.shape[1:]))
        for level in self._levels[1:]:
            yield level, world[level.parents]

    def _targets(self, nodes: Ints, above: Floats) -> Floats:
        """What rotations (W, n, 4) under such parents (n, W, 4) leave the nodes as they truly lie."""
        aims = quaternion.multiply(quaternion.conjugate(above), self._true[nodes])
        own = self._truth.local[1][nodes]
        return np.swapaxes(np.where(quaternion.dot(aims, own)[..., None] < 0, -aims, aims), 0, 1)


def budget_gain(skeleton: Skeleton, truth: SourceMotion, points: PointMatrix) -> Floats:
    """Return by how much each track (G,) reaches farther than to where others can make up for it; 1 for no rotation.

    Others are the next nodes below that a track turns; nothing makes up for points that hang on none of these.
    """
    turning = {each.node: i for i, each in enumerate(truth.moving) if each.path == "rotation"}
    nth = max(1, -(-len(truth.at) // PROBE_FRAMES))
    world = level_world_matrices(skeleton, [part[:, ::nth] for part in truth.local], truth.levels)
    turner = np.full(len(skeleton) + 1, -1)  # the nearest node that turns each; the last stands for "no parent"
    reach = np.zeros(len(skeleton))
    for level in truth.levels:
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
    shorter = np.ones(len(truth.moving))
    for node, i in turning.items():
        shorter[i] = np.clip(truth.moving[i].meters / max(2 * reach[node], 1e-30), 1, MAX_ANGLE_RAD)
    return shorter
