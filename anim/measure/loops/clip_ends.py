"""Many clips at once around their ends: the poses there, and what differs between end and start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.measure.error import orientation_probes
from anim.model import Clip, Skeleton
from anim.sampling.batch import ConcatenatedTracks
from anim.sampling.pose import sample_clips, world_by_node
from anim.sampling.times import FLOAT32_SPACING, MAX_JUMP_S

# Of the times start, just after it, a probe on, a frame on, and the same before the end: the pose, the speed (times the
# probe's length), the first and the last frame's motion, and the start against where the last frame goes on to.
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
SPEED = 1  # its row
TIMES_WITHOUT_FRAME = [0, 1, 2, 5, 6, 7]
WITHOUT_FRAME = DIFFERENCES[:2, TIMES_WITHOUT_FRAME]  # where all parts have the frame 0: the others are 0, or the first
STEP_TIME_INDEX = [0, 1, 1, 3, 4, 6, 6, 7]  # when a STEP track is looked at: it has no speed


@dataclass(frozen=True, slots=True)
class LoopRange:
    """A part of a clip that is played in a loop.

    start, end: s, start ≤ end. frame: s, from one frame to the next, 0 where motion per frame is not asked for.
    root: the node whose way is taken off, −1 for none.
    """

    clip: Clip
    start: float
    end: float
    frame: float = 0.0
    root: int = -1

    @property
    def probe(self) -> float:
        """Seconds from an end to where the speed there is looked at."""
        return min(orientation_probes.SPEED_STEP, (self.end - self.start) / 4)

    @property
    def shortest(self) -> float:
        """Seconds from an end within which two keys stand for a jump, which is no speed."""
        return min(MAX_JUMP_S + 2 * FLOAT32_SPACING * abs(self.end), self.probe / 2)

    def times(self) -> Floats:
        """Return the times (T,) of DIFFERENCES."""
        after = np.array([0.0, self.shortest, self.probe, self.frame])
        return np.concatenate((self.start + after, self.end - after[::-1]))


@dataclass(frozen=True, slots=True)
class EndPoses:
    """A part at the T times of DIFFERENCES. world: (N, T, 3, 4). weights: (T, M) by node, of meshes that morph."""

    world: Floats
    weights: dict[int, Floats]


def poses_around_ends(
    skeleton: Skeleton,
    parts: Sequence[LoopRange],
    groups: Sequence[ConcatenatedTracks] | None = None,
    *,
    has_frame: bool = True,
) -> list[EndPoses]:
    """Return each range around its ends, the way of its root taken off.

    groups: the tracks of all their clips, `joined`, for callers that have them. has_frame: False for the times of
    WITHOUT_FRAME only.
    """
    every = np.array([part.times() for part in parts])
    chosen = slice(None) if has_frame else TIMES_WITHOUT_FRAME
    times, held = every[:, chosen], every[:, STEP_TIME_INDEX][:, chosen]
    clips = [part.clip for part in parts]
    whole, weights = sample_clips(skeleton, clips, times, step_times=held, groups=groups)
    world = world_by_node(skeleton, whole)
    world = world.reshape(len(skeleton), *times.shape, 3, 4)
    for i, part in enumerate(parts):
        remove_root_motion(skeleton, world[:, i], part.root)
    return [EndPoses(world[:, i], weights[i]) for i in range(len(parts))]


def remove_root_motion(skeleton: Skeleton, world: Floats, root: int) -> None:
    """Take the way of node `root` since the first frame off world matrices (N, F, 3, 4), in place; −1: of none."""
    if root >= 0:
        way = world[root, :, :, 3] - world[root, :1, :, 3]
        world[..., 3] -= skeleton.descendants(root)[:, None, None] * way


def differences(values: Floats, axis: int, wanted: Floats = DIFFERENCES) -> Floats:
    """Return differences of values along the axis of their times. wanted: (D, T), or WITHOUT_FRAME."""
    return np.asarray(np.moveaxis(np.tensordot(wanted, values, (1, axis)), 0, axis))
