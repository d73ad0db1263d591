"""Times at which two versions of a clip are compared: keys, their middles, a grid, and moments before STEP keys."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints, unique_sorted
from anim.model import Clip, Interpolation
from anim.model.time_axis import merge_times
from anim.sampling.times import FEWER_FRAMES, SHORTER_CLIP, check_duration, check_fps, frame_times

SAME_MOMENT = 1e-6  # s; closer times are equal, written as float32 and as float64
FPS = 120.0  # fps of the grid for motion between keys
MAX_SPARSE_TIMES = 8192  # a minute of the grid; longer clips with few keys have fewer times between two keys
MIN_TIMES_PER_INTERVAL = 32  # between two keys of such clips


def key_and_mid_times(*clips: Clip) -> Floats:
    """Return every key time of the clips and the middle of every interval, in seconds, increasing."""
    keys = _key_times(clips)
    return np.sort(np.concatenate((keys, (keys[1:] + keys[:-1]) / 2)), kind="stable")


def dense_times(*clips: Clip, fps: float = FPS) -> Floats:
    """Return key and mid times, a grid of `fps` frames per second, and the moments before STEP keys.

    In seconds, increasing. The grid includes 0 s, and starts with the last frame before the first key, which is equal
    to all earlier ones. Frames that differ from a key by rounding are that key.
    """
    fps = check_fps(fps)
    keys = key_and_mid_times(*clips)
    frames = grid_times(*clips, fps=fps, start=max(math.ceil((keys[0] - SAME_MOMENT) * fps) - 1, 0) / fps)
    after = np.minimum(np.searchsorted(keys, frames), len(keys) - 1)
    apart = np.minimum(np.abs(keys[after] - frames), np.abs(frames - keys[np.maximum(after - 1, 0)]))
    return unique_sorted(np.concatenate((keys, frames[apart > SAME_MOMENT], *_before_jumps(clips))))


def grid_times(*clips: Clip, fps: float = FPS, start: float = 0.0) -> Floats:
    """Return the times of a grid of `fps` frames per second, from `start` to the end of the clips, in seconds.

    Of long clips with few keys only some pairs of neighboring frames between two keys, so that the number of times is
    linear in keys, and speeds are still measured from frame to frame.
    """
    advice = SHORTER_CLIP if fps == FPS else FEWER_FRAMES  # most commands have no option for this rate
    frames = frame_times(start, max((clip.end for clip in clips), default=0.0), fps=fps, help=advice)
    if len(frames) <= MAX_SPARSE_TIMES:
        return frames
    first = np.searchsorted(frames, _key_times(clips))
    edges = np.concatenate(([0], first, [len(frames)]))
    counts = np.diff(edges)
    pairs = np.where(counts > _most_times(len(counts)), _most_times(len(counts)) // 2, counts)
    interval, part = _enumerate_parts(pairs)
    starts = edges[interval] + part * counts[interval] // pairs[interval]
    chosen = np.unique(np.concatenate((starts, starts + 1, [0])).clip(max=len(frames) - 1))
    return np.asarray(frames[chosen])


def cut_times(*clips: Clip, parts: int, step: float) -> Floats:
    """Return the clips' key times, the moments before STEP keys, and divisions of all intervals.

    In seconds, increasing. Each interval between neighboring keys is divided into equal parts. parts: minimum number of
    parts of an interval, 1 … 32. step: s, maximum duration of a part, but for long clips with few keys; > 0.
    Raises UnsupportedError for the clips that `dense_times` refuses.
    """
    keys = _key_times(clips)
    check_duration(0.0, float(keys[-1]), fps=FPS, help=SHORTER_CLIP)
    gaps = np.diff(keys)
    counts = np.maximum(np.ceil(gaps / step).astype(np.int64), parts)
    if counts.sum() > MAX_SPARSE_TIMES:
        counts = np.minimum(counts, _most_times(len(counts)))
    gap, part = _enumerate_parts(counts)
    within = keys[gap] + gaps[gap] * (part / counts[gap])
    return unique_sorted(np.concatenate((within, keys[-1:], *_before_jumps(clips))))


def _most_times(intervals: int) -> int:
    """The most times in one of so many intervals between keys, of a clip with more than MAX_SPARSE_TIMES."""
    return max(MAX_SPARSE_TIMES // intervals, MIN_TIMES_PER_INTERVAL)


def _enumerate_parts(counts: Ints) -> tuple[Ints, Ints]:
    """The interval (P,) of each part, and its number in the interval (P,). counts: parts of each interval."""
    interval = np.repeat(np.arange(len(counts)), counts)
    return interval, np.arange(len(interval)) - np.repeat(np.cumsum(counts) - counts, counts)


def _key_times(clips: Sequence[Clip]) -> Floats:
    """All key times of the clips, increasing; 0 without tracks."""
    keys = merge_times(axis for clip in clips for axis in clip.time_axes)
    return keys if len(keys) else np.zeros(1)


def _before_jumps(clips: Sequence[Clip]) -> list[Floats]:
    """The last moments before STEP keys, where the error can be as large as the jump."""
    steps = (track for clip in clips for track in clip.tracks if track.interpolation is Interpolation.STEP)
    axes = dict.fromkeys(track.time_axis for track in steps if len(track.times) > 1)
    return [np.nextafter(axis.times[1:], 0) for axis in axes]
