"""A pose before the motion: the T-pose that many recordings have as their first frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Clip, Interpolation

MIN_FRAMES = 10
MIN_ANGLE_RAD = np.radians(10.0)
NEXT_STEPS, NEXT_RATIO = 2, 5.0  # the first step is so many times longer than each of the next: a moving body is not
OTHER_RATIO = 1.5  # and than every other one
MIN_JOINTS = 2


@dataclass(frozen=True, slots=True)
class LeadingPose:
    """A first frame that is no part of the motion.

    num_joints: count of joints that jump to the second frame. node: the one that rotates most, by angle, in rad.
    end: s, time of the second frame.
    """

    num_joints: int
    node: int
    angle: float
    end: float


def find_leading_pose(clip: Clip) -> LeadingPose | None:
    """Return the pose of the first frame of a recording if the motion starts after it, None otherwise.

    clip: with keys on one grid of frames. Two joints must jump: rotate to the second frame by 10° or more, farther than
    between any other frames, and several times farther than between the next ones.
    (0°, 80°, 81°, 82° …, of two joints) → LeadingPose(2, …); (0°, 10°, 20° …) → None
    """
    jumps: list[tuple[float, int]] = []
    end = 0.0
    for track in clip.tracks:
        is_linear = track.path == "rotation" and track.interpolation is Interpolation.LINEAR
        if track.node is None or not is_linear or len(track.times) < MIN_FRAMES:
            continue
        angles = quaternion.angle_between(track.values[:-1], track.values[1:])
        if _is_jump(angles):
            jumps.append((float(angles[0]), track.node))
            end = float(track.times[1])
    if len(jumps) < MIN_JOINTS:
        return None
    angle, node = max(jumps)
    return LeadingPose(len(jumps), node, angle, end)


def _is_jump(angles: Floats) -> bool:
    first, others = angles[0], angles[1:]
    apart = first > NEXT_RATIO * others[:NEXT_STEPS].max() and first > OTHER_RATIO * others.max()
    return bool(apart and first >= MIN_ANGLE_RAD)
