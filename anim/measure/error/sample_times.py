"""Times at which two versions of a clip are compared: keys, their middles, a grid, and moments before STEP keys."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, unique_sorted
from anim.model import Clip, Interpolation
from anim.model.time_axis import merge_times
from anim.sampling.times import check_duration, check_fps, frame_times

SAME_MOMENT = 1e-6  # s; closer times are equal, written as float32 and as float64
FPS = 120.0  # fps of the grid for motion between keys


def key_and_mid_times(*clips: Clip) -> Floats:
    """Return every key time of the clips and the middle of every interval, in seconds, increasing."""
    keys = _key_times(clips)
    return np.sort(np.concatenate((keys, (keys[1:] + keys[:-1]) / 2)), kind="stable")


def dense_times(*clips: Clip, fps: float = FPS) -> Floats:
    """Return key and mid times, a grid of `fps` frames per second, and the moments before STEP keys.

    In seconds, increasing. The grid includes 0 s, and starts with the last frame before the first key, which is equal
    to all earlier ones. Frames that differ from a key by rounding are that key.
    """
    check_fps(fps)
    end = max((clip.end for clip in clips), default=0.0)
    keys = key_and_mid_times(*clips)
    frames = frame_times(max(math.ceil((keys[0] - SAME_MOMENT) * fps) - 1, 0) / fps, end, fps=fps)
    after = np.minimum(np.searchsorted(keys, frames), len(keys) - 1)
    apart = np.minimum(np.abs(keys[after] - frames), np.abs(frames - keys[np.maximum(after - 1, 0)]))
    return unique_sorted(np.concatenate((keys, frames[apart > SAME_MOMENT], *_before_jumps(clips))))


def cut_times(*clips: Clip, parts: int, step: float) -> Floats:
    """Return the clips' key times, the moments before STEP keys, and divisions of all intervals.

    In seconds, increasing. Each interval between neighboring keys is divided into equal parts. parts: minimum number of
    parts of an interval, ≥ 1. step: s, maximum duration of a part; > 0.
    Raises DataRangeError for the clips that `dense_times` refuses.
    """
    keys = _key_times(clips)
    check_duration(0.0, float(keys[-1]), fps=FPS)
    gaps = np.diff(keys)
    counts = np.maximum(np.ceil(gaps / step).astype(np.int64), parts)
    gap = np.repeat(np.arange(len(gaps)), counts)
    part = np.arange(len(gap)) - np.repeat(np.cumsum(counts) - counts, counts)
    within = keys[gap] + gaps[gap] * (part / counts[gap])
    return unique_sorted(np.concatenate((within, keys[-1:], *_before_jumps(clips))))


def _key_times(clips: Sequence[Clip]) -> Floats:
    """All key times of the clips, increasing; 0 without tracks."""
    keys = merge_times(axis for clip in clips for axis in clip.time_axes)
    return keys if len(keys) else np.zeros(1)


def _before_jumps(clips: Sequence[Clip]) -> list[Floats]:
    """The last moments before STEP keys, where the error can be as large as the jump."""
    steps = (track for clip in clips for track in clip.tracks if track.interpolation is Interpolation.STEP)
    axes = dict.fromkeys(track.time_axis for track in steps if len(track.times) > 1)
    return [np.nextafter(axis.times[1:], 0) for axis in axes]
