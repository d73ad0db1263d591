"""Criteria of loops: visible gaps, gaps of one frame, and the frames of a clip."""

from __future__ import annotations

from collections.abc import Sequence

from anim.measure.inspect import frame_rate
from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.joint_gaps import JointGap, joint_gaps
from anim.measure.loops.seam import Seam
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip

NOISE_PER_SIZE = 1e-5  # of the model's size; smaller gaps are rounding
VISIBLE_GAP_PER_SIZE = 1e-3  # of the model's size; larger gaps are visible
MAX_MISSING_FRAMES = 1.6  # gap of a clip open by one frame, relative to the motion per frame next to it
DEFAULT_FPS = 30.0
MIN_REGULAR_FRACTION = 0.9  # of the keys, on the frames of a rate


def is_one_frame(seam: Seam) -> bool:
    """Return whether a loop gap is about the next frame's motion."""
    return seam.gap <= MAX_MISSING_FRAMES * seam.frame and seam.going_on <= seam.frame


def open_joints(skin: SkinMotion, parts: Sequence[LoopRange]) -> list[tuple[JointGap, ...]]:
    """Return the joints of each range with a gap above rounding, the largest first."""
    noise = NOISE_PER_SIZE * skin.size
    return [tuple([each for each in gaps if each.gap > noise]) for gaps in joint_gaps(skin, parts)]


def are_few(joints: Sequence[JointGap], moving: set[int]) -> bool:
    """Return whether fewer joints are open than close while they move."""
    return len(joints) < len(moving - {each.node for each in joints})


def loop_frame_rate(clip: Clip) -> float:
    """Return the frame rate of an analysis: of regular keys their own, else DEFAULT_FPS.

    A few keys of other tracks between the frames, as of a visibility track, don't change the rate.
    """
    times = clip.key_times
    longest = max((axis.times for axis in clip.time_axes), key=len, default=times)
    found = frame_rate.estimate_frame_rate(longest if len(longest) > MIN_REGULAR_FRACTION * len(times) else times)
    return found.fps if found is not None and found.regular > MIN_REGULAR_FRACTION else DEFAULT_FPS


def frame_duration(fps: float, start: float, end: float) -> float:
    """Return the duration of a frame in s, at most half of a time range; 0 of an empty one."""
    return min(1 / fps, (end - start) / 2) if end > start else 0.0
