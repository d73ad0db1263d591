"""Last frames of loops that are missing, or duplicate."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.joint_gaps import moving_nodes
from anim.measure.loops.loop_criteria import (
    NOISE_PER_SIZE,
    VISIBLE_GAP_PER_SIZE,
    are_few,
    frame_duration,
    is_one_frame,
    loop_frame_rate,
    open_joints,
)
from anim.measure.loops.seam import Seam, measure_seams
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip

MAX_DUPLICATE_FRAME_S = 0.1  # longer pauses are authored
MIN_FRAMES_WITH_DUPLICATE = 3.5  # of a clip with a duplicate frame: it also moves, from the first frame and to the last


class EndFrameKind(StrEnum):
    """Fault of the last frame of a loop."""

    MISSING = "missing"
    DUPLICATE = "duplicate"


class EndFrame(NamedTuple):
    """Last frame of a loop that is missing or duplicate. duration: of a frame, in s. gap: loop gap in m."""

    kind: EndFrameKind
    duration: float
    gap: float


def find_end_frames(skin: SkinMotion, clips: Sequence[Clip], roots: Sequence[int]) -> list[EndFrame | None]:
    """Return the fault of the last frame of each clip, None without one.

    Missing: `analyze_loop` calls the clip open by one frame, with a visible gap; the motion inside is not sampled.
    Duplicate: two frames at the end have the pose of the first one, and the clip moves visibly before and after them.
    roots: nodes of root motion by clip, −1 for none.
    """
    if not len(skin.points):
        return [None] * len(clips)
    ranges = [_whole_range(clip, root) for clip, root in zip(clips, roots, strict=True)]
    return [_end_frame(skin, each, seam) for each, seam in zip(ranges, measure_seams(skin, ranges), strict=True)]


def _whole_range(clip: Clip, root: int) -> LoopRange:
    return LoopRange(clip, clip.start, clip.end, frame_duration(loop_frame_rate(clip), clip.start, clip.end), root)


def _end_frame(skin: SkinMotion, whole: LoopRange, seam: Seam) -> EndFrame | None:
    if whole.frame == 0:
        return None
    if seam.gap > VISIBLE_GAP_PER_SIZE * skin.size:
        kind = EndFrameKind.MISSING if is_one_frame(seam) and _is_missing(skin, whole) else None
    else:
        is_closed = seam.gap <= NOISE_PER_SIZE * skin.size
        kind = EndFrameKind.DUPLICATE if is_closed and _is_duplicate(skin, whole) else None
    return None if kind is None else EndFrame(kind, whole.frame, seam.gap)


def _is_missing(skin: SkinMotion, whole: LoopRange) -> bool:
    clip, start, end, root = whole.clip, whole.start, whole.end, whole.root
    moving = moving_nodes(skin, clip, start, end, whole.frame, root)
    return not are_few(open_joints(skin, clip, start, end, root), moving)


def _is_duplicate(skin: SkinMotion, whole: LoopRange) -> bool:
    frame, end = whole.frame, whole.end
    if frame > MAX_DUPLICATE_FRAME_S or end - whole.start < MIN_FRAMES_WITH_DUPLICATE * frame:
        return False
    before = np.array([whole.start, end - 2 * frame, end - frame])
    first, last, still = skin.steps(whole.clip, np.stack((before, before + frame)), whole.root) / skin.size
    return bool(min(first, last) > VISIBLE_GAP_PER_SIZE and still <= NOISE_PER_SIZE)
