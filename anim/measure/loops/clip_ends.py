"""Poses around the start and end of many clips at once, and their differences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.measure.error import orientation_probes
from anim.model import Clip, Skeleton
from anim.sampling.batch import ConcatenatedTracks
from anim.sampling.clips import sample_world_matrices
from anim.sampling.times import FLOAT32_SPACING, MAX_JUMP_S

# Rows are differences, columns the times start, just after it, one probe later, one frame later, and the same
# before the end. Rows: pose; velocity (× probe); first and last frame's motion; start against extrapolated end.
DIFFERENCES = np.array(
    [
        [-1, 0, 0, 0, 0, 0, 0, 1],
        [0, 1, -1, 0, 0, -1, 1, 0],
        [-1, 0, 0, 1, 0, 0, 0, 0],
        [0, 0, 0, 0, -1, 0, 0, 1],
        [-1, 0, 0, 0, -1, 0, 0, 2],
    ],
    float,
)
VELOCITY = 1  # index of the velocity row
TIMES_WITHOUT_FRAME = [0, 1, 2, 5, 6, 7]
WITHOUT_FRAME = DIFFERENCES[:2, TIMES_WITHOUT_FRAME]  # for ranges without motion per frame: the other rows are then 0
STEP_TIME_INDEX = [0, 1, 1, 3, 4, 6, 6, 7]  # times of STEP tracks for each column: they have no velocity


class LoopRange(NamedTuple):
    """Time range of a clip that is played as a loop.

    start, end: s, start ≤ end. frame: s, duration of a frame, 0 if motion per frame is not needed.
    root: node whose displacement is removed, −1 for none.
    """

    clip: Clip
    start: float
    end: float
    frame: float = 0.0
    root: int = -1

    @property
    def probe(self) -> float:
        """Seconds from an end to the sample for the velocity there."""
        return min(orientation_probes.SPEED_STEP, (self.end - self.start) / 4)

    @property
    def shortest(self) -> float:
        """Seconds from an end within which two keys represent a jump instead of a velocity."""
        return min(MAX_JUMP_S + 2 * FLOAT32_SPACING * abs(self.end), self.probe / 2)

    def times(self) -> Floats:
        """Return the times (T,) of DIFFERENCES."""
        after = np.array([0.0, self.shortest, self.probe, self.frame])
        return np.concatenate((self.start + after, self.end - after[::-1]))


class EndPoses(NamedTuple):
    """A range at the T times of DIFFERENCES.

    world: (N, T, 3, 4). weights: (T, M) by node, of morphing meshes.
    """

    world: Floats
    weights: dict[int, Floats]


def poses_around_ends(
    skeleton: Skeleton,
    parts: Sequence[LoopRange],
    groups: Sequence[ConcatenatedTracks] | None = None,
    *,
    has_frame: bool = True,
) -> list[EndPoses]:
    """Return the poses of each range around its ends, without root motion.

    groups: the tracks of all clips from `concatenate`, if the caller has them. has_frame: False for the times of
    WITHOUT_FRAME only.
    """
    every = np.array([part.times() for part in parts])
    chosen = slice(None) if has_frame else TIMES_WITHOUT_FRAME
    times, held = every[:, chosen], every[:, STEP_TIME_INDEX][:, chosen]
    clips = [part.clip for part in parts]
    world, weights = sample_world_matrices(skeleton, clips, times, step_times=held, groups=groups)
    world = world.reshape(len(skeleton), *times.shape, 3, 4)
    for i, part in enumerate(parts):
        remove_root_motion(skeleton, world[:, i], part.root)
    return [EndPoses(world[:, i], weights[i]) for i in range(len(parts))]


def remove_root_motion(skeleton: Skeleton, world: Floats, root: int, origin: Floats | None = None) -> None:
    """Remove the displacement of node `root` since the first frame from world matrices, in place.

    world: (N, F, 3, 4), or (N, ..., 3, 4) with `origin`: (3,) m, the root's place in the first frame. root: −1 for
    none.
    """
    if root >= 0:
        way = world[root, ..., 3] - (world[root, :1, :, 3] if origin is None else origin)
        world[..., 3] -= skeleton.descendants(root).reshape(-1, *[1] * way.ndim) * way


def differences(values: Floats, axis: int, wanted: Floats = DIFFERENCES) -> Floats:
    """Return differences of values along the axis of their times. wanted: (D, T), or WITHOUT_FRAME."""
    return np.asarray(np.moveaxis(np.tensordot(wanted, values, (1, axis)), 0, axis))
