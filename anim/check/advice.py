"""Advice as command lines: the frame rate and the options that select the clips of a finding."""

from __future__ import annotations

import math
from collections.abc import Sequence

from anim.gltf.reading import reader
from anim.measure.inspect.report import ClipReport
from anim.measure.loops.recommendations import blend_option

MIN_REGULAR_FRACTION = 0.9  # fraction of keys on the grid below which a frame rate is not reliable
MAX_IRREGULAR_FPS = 60.0  # advised where keys are on no frame grid; the spacing of the closest ones says little
DEFAULT_FPS = 60.0  # advised for clips without a frame rate of their own
MIN_LINEAR_FPS = 60  # advised for splines as LINEAR keys: they often have one key or two a second


def clip_advice(advice: str, clips: Sequence[ClipReport], numbers: Sequence[int]) -> str:
    """Return advice for the clips at some indices.

    {fps} becomes their frame rate, {finer} twice that, {linear} the same but at least MIN_LINEAR_FPS, {blend} the
    option for the time over which `loop` closes them, and {clips} the options that select them.
    """
    if "{" not in advice:
        return advice
    by_number = {clip.index: clip for clip in clips}
    chosen = [by_number[i] for i in numbers]
    fps, blend = frame_rate(chosen), blend_option([clip.duration_s for clip in chosen])
    linear, clips_option = max(2 * fps, MIN_LINEAR_FPS), reader.choose_option(numbers)
    return advice.format(fps=fps, finer=2 * fps, linear=linear, blend=blend, clips=clips_option)


def frame_rate(clips: Sequence[ClipReport]) -> int:
    """Return the smallest whole frame rate with a frame at every key of the clips, else DEFAULT_FPS."""
    return math.ceil(max(map(_frame_rate, clips)) - 1e-3)


def _frame_rate(clip: ClipReport) -> float:
    """Frame rate of a clip; of irregular keys at most MAX_IRREGULAR_FPS, however close some of them are."""
    fps = clip.frame_rate_fps or DEFAULT_FPS
    return fps if (clip.frame_rate_regular or 0.0) >= MIN_REGULAR_FRACTION else min(fps, MAX_IRREGULAR_FPS)
