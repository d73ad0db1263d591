"""World-space compensation: rotations that correct the errors of their ancestors.

The error of a joint's rotation moves all its descendants. If the joints below target their source orientation in the
world instead of their own source values, under parents as players will show them, the error only moves the next
joints: the moment arm of a hip is the thigh and no longer the whole leg, so that upper joints allow coarser storage.
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
from anim.optimization.search.playback import level_world_matrices, required_levels
from anim.optimization.search.source_motion import PROBE_FRAMES, SourceMotion
from anim.optimization.search.time_axes import SharedAxis

MAX_BUDGET_GAIN = 20.0  # ratio of the moment arm to the compensated one


@dataclass(frozen=True, slots=True)
class _Level:
    """Nodes (n,) of one depth, their parents (n,), and their rotation tracks (n,); −1 for none."""

    nodes: Ints
    parents: Ints
    tracks: Ints


class ParentCompensation:
    """Computes keys level by level, from the roots down to the last rotation tracks."""

    def __init__(self, skeleton: Skeleton, source: SourceMotion, candidates: Candidates) -> None:
        self._source = source
        self._candidates = candidates
        tracks = np.full(len(skeleton), -1)
        for i, each in enumerate(source.moving):
            if each.path == "rotation":
                tracks[each.node] = i
        needed = np.zeros(len(skeleton), np.bool_)
        for nodes in required_levels(skeleton, np.flatnonzero(tracks >= 0)):
            needed[nodes] = True
        chosen = [nodes[needed[nodes]] for nodes in source.levels]
        self._levels = [_Level(nodes, skeleton.parents[nodes], tracks[nodes]) for nodes in chosen if len(nodes)]
        self._true = np.empty_like(source.local[1])
        for level, above in self._descending(self._true):
            self._true[level.nodes] = quaternion.multiply(above, quaternion.normalize(source.local[1][level.nodes]))

    def follow(
        self, axes: Sequence[SharedAxis], tolerances: Sequence[float], rotation: Floats
    ) -> Iterator[tuple[int, Candidate]]:
        """Yield each rotation track on an axis with its candidate.

        Writes the played values of each to `rotation` (N, W, 4).
        tolerances: (G,) for storage, in units of values. rotation: played values of tracks without an axis.
        """
        on = np.full(len(self._source.moving) + 1, -1)  # the last entry is for nodes without a track
        for number, axis in enumerate(axes):
            on[list(axis.members)] = number
        world = np.empty_like(rotation)
        for level, above in self._descending(world):
            axis_of = on[level.tracks]
            for number in sorted(set(axis_of[axis_of >= 0].tolist())):
                here = np.flatnonzero(axis_of == number)
                nodes, members = level.nodes[here], level.tracks[here].tolist()
                found = self._candidates.compensated(
                    axes[number], members, self._targets(nodes, above[here]), tolerances
                )
                for node, member, candidate in zip(nodes.tolist(), members, found, strict=True):
                    rotation[node] = candidate.shown
                    yield member, candidate
            world[level.nodes] = quaternion.multiply(above, quaternion.normalize(rotation[level.nodes]))

    def _descending(self, world: Floats) -> Iterator[tuple[_Level, Floats]]:
        """Every level with the world rotations (n, W, 4) of its nodes' parents, which callers fill in before."""
        for depth, level in enumerate(self._levels):
            if depth:
                yield level, world[level.parents]
            else:
                yield level, np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(level.nodes), *world.shape[1:]))

    def _targets(self, nodes: Ints, above: Floats) -> Floats:
        """Local rotations (W, n, 4) that restore the source's world orientation under parents (n, W, 4)."""
        targets = quaternion.multiply(quaternion.conjugate(above), self._true[nodes])
        own = self._source.local[1][nodes]
        return np.swapaxes(np.where(quaternion.dot(targets, own)[..., None] < 0, -targets, targets), 0, 1)


def budget_gain(skeleton: Skeleton, source: SourceMotion, points: PointMatrix) -> Floats:
    """Return the ratio of each track's moment arm to the compensated one (G,); 1 except for rotations.

    The compensated arm ends at the next animated rotation below; points bound above that are not compensated.
    """
    turning = {each.node: i for i, each in enumerate(source.moving) if each.path == "rotation"}
    nth = max(1, -(-len(source.at) // PROBE_FRAMES))
    world = level_world_matrices(skeleton, [part[:, ::nth] for part in source.local], source.levels)
    turner = np.full(len(skeleton) + 1, -1)  # nearest rotated ancestor; the last entry is for "no parent"
    reach = np.zeros(len(skeleton))
    for level in source.levels:
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
