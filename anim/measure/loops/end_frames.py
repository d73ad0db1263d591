"""Last frames of loops that are missing, or duplicate."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
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
from anim.measure.loops.seam import measure_seams
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


def find_end_frames(
    skin: SkinMotion,
    clips: Sequence[Clip],
    roots: Sequence[int],
    gaps: Sequence[float],
    kinds: Collection[EndFrameKind] = tuple(EndFrameKind),
) -> list[EndFrame | None]:
    """Return the fault of the last frame of each clip, None without one.

    Missing: `analyze_loop` calls the clip open by one frame, with a visible gap; the motion inside is not sampled.
    Duplicate: two frames at the end have the pose of the first one, and the clip moves visibly before and after them.
    roots: nodes of root motion by clip, −1 for none. gaps: loop gaps in m, as `measure_seams` returns them.
    kinds: those that are looked for.
    """
    if not len(skin.points):
        return [None] * len(clips)
    rates = {clip.time_axes: loop_frame_rate(clip) for clip in {each.time_axes: each for each in clips}.values()}
    ranges = [_whole_range(clip, rates[clip.time_axes], root) for clip, root in zip(clips, roots, strict=True)]
    size = skin.size
    missing = [i for i, gap in enumerate(gaps) if ranges[i].frame and gap > VISIBLE_GAP_PER_SIZE * size]
    duplicate = [i for i, gap in enumerate(gaps) if _may_be_duplicate(ranges[i]) and gap <= NOISE_PER_SIZE * size]
    found: dict[int, EndFrameKind] = {}
    if EndFrameKind.MISSING in kinds:
        found |= dict.fromkeys(_with(missing, _are_missing, skin, ranges), EndFrameKind.MISSING)
    if EndFrameKind.DUPLICATE in kinds:
        found |= dict.fromkeys(_with(duplicate, _are_duplicate, skin, ranges), EndFrameKind.DUPLICATE)
    return [
        EndFrame(found[i], each.frame, gap) if i in found else None
        for i, (each, gap) in enumerate(zip(ranges, gaps, strict=True))
    ]


def _whole_range(clip: Clip, fps: float, root: int) -> LoopRange:
    return LoopRange(clip, clip.start, clip.end, frame_duration(fps, clip.start, clip.end), root)


def _may_be_duplicate(whole: LoopRange) -> bool:
    frame = whole.frame
    return 0 < frame <= MAX_DUPLICATE_FRAME_S and whole.end - whole.start >= MIN_FRAMES_WITH_DUPLICATE * frame


def _with(
    numbers: Sequence[int],
    judge: Callable[[SkinMotion, Sequence[LoopRange]], list[bool]],
    skin: SkinMotion,
    ranges: Sequence[LoopRange],
) -> list[int]:
    """Those of some indices of ranges for which a function is true."""
    fits = measure_on_parts(skin, [ranges[i] for i in numbers], judge)
    return [i for i, each in zip(numbers, fits, strict=True) if each]


def _are_missing(skin: SkinMotion, ranges: Sequence[LoopRange]) -> list[bool]:
    near = [i for i, seam in enumerate(measure_seams(skin, ranges)) if is_one_frame(seam)]
    some = [ranges[i] for i in near]
    both = zip(near, open_joints(skin, some), moving_nodes(skin, some), strict=True)
    fitting = {i for i, joints, moving in both if not are_few(joints, moving)}
    return [i in fitting for i in range(len(ranges))]


def _are_duplicate(skin: SkinMotion, ranges: Sequence[LoopRange]) -> list[bool]:
    if not ranges:
        return []
    (still,) = _frame_steps(skin, ranges, [each.end - each.frame for each in ranges])
    at_rest = np.flatnonzero(still <= NOISE_PER_SIZE).tolist()  # few: the other frames are sampled for those alone
    some = [ranges[i] for i in at_rest]
    steps = _frame_steps(skin, some, [each.start for each in some], [each.end - 2 * each.frame for each in some])
    moves = dict(zip(at_rest, steps.min(axis=0) > VISIBLE_GAP_PER_SIZE, strict=True))
    return [bool(moves.get(i, False)) for i in range(len(ranges))]


def _frame_steps(skin: SkinMotion, ranges: Sequence[LoopRange], *starts: Sequence[float]) -> Floats:
    """Largest motion (S, R) of a vertex in S frames of each range, of the model's size. starts: of the frames, s."""
    if not ranges:
        return np.zeros((len(starts), 0))
    before = np.array(starts).T
    after = before + np.array([each.frame for each in ranges])[:, None]
    return skin.steps(ranges, np.stack((before, after), axis=1)).T / skin.size
