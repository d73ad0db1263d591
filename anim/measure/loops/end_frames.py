"""Last frames of loops that are missing, or duplicate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.divided_ranges import measure_on_parts
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
    return measure_on_parts(skin, ranges, _find_end_frames)


def _find_end_frames(skin: SkinMotion, ranges: Sequence[LoopRange]) -> list[EndFrame | None]:
    seams = measure_seams(skin, ranges)
    missing = [i for i, seam in enumerate(seams) if ranges[i].frame and _is_visible(skin, seam) and is_one_frame(seam)]
    duplicate = [i for i, seam in enumerate(seams) if _may_be_duplicate(ranges[i]) and _is_noise(skin, seam)]
    kinds = dict.fromkeys(_with(missing, _are_missing, skin, ranges), EndFrameKind.MISSING)
    kinds |= dict.fromkeys(_with(duplicate, _are_duplicate, skin, ranges), EndFrameKind.DUPLICATE)
    return [
        EndFrame(kinds[i], each.frame, seam.gap) if i in kinds else None
        for i, (each, seam) in enumerate(zip(ranges, seams, strict=True))
    ]


def _whole_range(clip: Clip, root: int) -> LoopRange:
    return LoopRange(clip, clip.start, clip.end, frame_duration(loop_frame_rate(clip), clip.start, clip.end), root)


def _is_visible(skin: SkinMotion, seam: Seam) -> bool:
    return seam.gap > VISIBLE_GAP_PER_SIZE * skin.size


def _is_noise(skin: SkinMotion, seam: Seam) -> bool:
    return seam.gap <= NOISE_PER_SIZE * skin.size


def _may_be_duplicate(whole: LoopRange) -> bool:
    frame = whole.frame
    return 0 < frame <= MAX_DUPLICATE_FRAME_S and whole.end - whole.start >= MIN_FRAMES_WITH_DUPLICATE * frame


def _with(
    numbers: Sequence[int],
    judge: Callable[[SkinMotion, Sequence[LoopRange]], Sequence[bool]],
    skin: SkinMotion,
    ranges: Sequence[LoopRange],
) -> list[int]:
    """Those of some indices of ranges for which a function is true."""
    return [i for i, fits in zip(numbers, judge(skin, [ranges[i] for i in numbers]), strict=True) if fits]


def _are_missing(skin: SkinMotion, ranges: Sequence[LoopRange]) -> list[bool]:
    both = zip(open_joints(skin, ranges), moving_nodes(skin, ranges), strict=True)
    return [not are_few(joints, moving) for joints, moving in both]


def _are_duplicate(skin: SkinMotion, ranges: Sequence[LoopRange]) -> list[bool]:
    if not ranges:
        return []
    before = np.array([(each.start, each.end - 2 * each.frame, each.end - each.frame) for each in ranges])
    after = before + np.array([each.frame for each in ranges])[:, None]
    first, last, still = skin.steps(ranges, np.stack((before, after), axis=1)).T / skin.size
    fits = (np.minimum(first, last) > VISIBLE_GAP_PER_SIZE) & (still <= NOISE_PER_SIZE)
    return [bool(each) for each in fits]
