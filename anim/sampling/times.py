"""Frame times in seconds: the only module that converts frame rates to times.

A frame index belongs to a display; a time, in seconds, belongs to the clip. Frame k is at start + k / fps, computed in
float64 from the integer k, so that errors do not add up; the last frame is the clip's exact end.
"""

from __future__ import annotations

import math

import numpy as np

from anim import arrays
from anim.arguments import positive
from anim.arrays import Floats, Ints
from anim.errors import UnsupportedError, check_number

MIN_INTERVAL_FRAMES = (
    1e-3  # frames; a last interval shorter than this, or than float32 resolves at the end, is rounding
)
MAX_FRAMES = 10_000_000
MAX_MOVED_STEPS = 2  # float32 steps that a key may be moved by to differ from its neighbor
FEWER_FRAMES = "choose a lower `fps`, or shorten the motion with gltf-anim trim"
SHORTER_CLIP = (  # where the rate is no option, and time before the first key counts
    "shorten the clip with gltf-anim trim, which also moves a late start to 0 s, or choose others with `clip`"
)
FLOAT32_SPACING = 2.0**-23  # relative distance of neighboring float32 numbers
MIN_JUMP_S = 1e-6  # s; shortest time between two keys that represent a jump, to avoid denormal times near 0 s
MAX_JUMP_S = 1.5e-6  # s; with two float32 steps, the longest time between two keys that represent a jump


def check_fps(fps: float) -> float:
    """Return frames per second as a float. Raises ShapeError or RangeError unless it is a number above 0."""
    return positive(fps, "fps")


def check_duration(start: float, end: float, *, fps: float, help: str = FEWER_FRAMES) -> float:
    """Return the number of frames from `start` to `end` s, not rounded. Raises UnsupportedError for ten million.

    help: the way out, for the message.
    """
    frames = (end - start) * float(fps)
    if frames > MAX_FRAMES:
        raise too_many_frames(frames, fps, help=help)
    return frames


def too_many_frames(
    frames: float, fps: float, *, limit: int = MAX_FRAMES, help: str = FEWER_FRAMES
) -> UnsupportedError:
    """Return the error for more frames than the limit, whether the motion is too long or the rate too high."""
    number = f"{frames:.3g}" if math.isfinite(frames) else "too many"
    return UnsupportedError(f"{number} frames at {fps:g} fps (limit {limit})", help=help)


def frame_times(start: float, end: float, *, fps: float, help: str = FEWER_FRAMES) -> Floats:
    """Return the frame times (F,) in seconds from `start` to `end`, both of them exact.

    fps: frames per second, > 0. Raises RangeError otherwise, and UnsupportedError, with `help`, for over ten million
    frames.
    frame_times(0, 1, fps=4) → 0, 0.25, 0.5, 0.75, 1
    frame_times(0, 0.6, fps=4) → 0, 0.25, 0.5, 0.6
    """
    start, end, fps = check_number(start, "start"), check_number(end, "end"), check_fps(fps)
    frames = check_duration(start, end, fps=fps, help=help)
    sliver = max(MIN_INTERVAL_FRAMES, 2 * float(np.spacing(np.float32(end))) * fps)
    whole = max(math.ceil(frames - sliver), 1 if end > start else 0)
    times = start + np.arange(whole, dtype=np.float64) / fps
    return arrays.freeze(np.append(times, end)) if whole else arrays.freeze(np.array([start], np.float64))


def key_times(seconds: Floats) -> Floats:
    """Return times as stored in a file: rounded to float32, without duplicates."""
    return arrays.freeze(arrays.unique_sorted(np.asarray(seconds, np.float64).astype(np.float32).astype(np.float64)))


def just_before(times: Floats) -> Floats:
    """Return the float32 times before times (T,) in seconds, not below 0."""
    return np.nextafter(times.astype(np.float32), np.float32(0)).astype(np.float64)


def jump_time_before(seconds: Floats) -> Floats:
    """Return the latest times before `seconds` that differ in a file and are a jump's duration earlier."""
    stored = np.asarray(seconds, np.float64).astype(np.float32)
    earlier = np.nextafter(stored, np.float32(-np.inf)).astype(np.float64)
    return np.asarray(np.minimum(earlier, seconds - MIN_JUMP_S))


def jump_time_after(seconds: float) -> float:
    """Return the earliest time after `seconds` that differs in a file and is a jump's duration later."""
    later = np.nextafter(np.float32(seconds), np.float32(np.inf))
    return max(float(later), seconds + MIN_JUMP_S)


def min_interval(end: float, least: float) -> float:
    """Return the shortest time between keys up to `end` s: `least`, or two float32 steps if more."""
    return max(least, 2 * float(np.spacing(np.float32(end))))


def separate_float32(seconds: Floats) -> Floats:
    """Return times that strictly increase as float32; equal ones are moved by the fewest float32 steps.

    Keys of a jump coincide if they are moved to later times. The first and the last time stay. Times for which
    MAX_MOVED_STEPS are not enough are returned unchanged.
    separate_float32([0, 40, 40 + 1e-6]) → [0, 40 − 3.8e-6, 40]
    """
    original = seconds.astype(np.float32)
    if len(original) < 2 or (np.diff(original) > 0).all():
        return seconds
    stored = original.copy()
    for i in range(len(stored) - 2, -1, -1):
        stored[i] = min(stored[i], np.nextafter(stored[i + 1], np.float32(-np.inf)))
    stored[0] = original[0]
    for i in range(1, len(stored)):
        stored[i] = max(stored[i], np.nextafter(stored[i - 1], np.float32(np.inf)))
    if (np.abs(stored - original) > MAX_MOVED_STEPS * np.spacing(original)).any():
        return seconds
    return np.where(stored == original, seconds, stored.astype(np.float64))


def distinct_float32(seconds: Floats) -> Ints:
    """Return the indices of a subset of non-decreasing times (K,) that strictly increases as float32.

    The first and the last are kept; of equal times the first, at the end the last.
    """
    stored = seconds.astype(np.float32)
    if len(stored) < 2 or (np.diff(stored) > 0).all():
        return np.arange(len(stored))
    kept = [0]
    for i in range(1, len(stored)):
        if stored[i] > stored[kept[-1]]:
            kept.append(i)
        elif i == len(stored) - 1 and len(kept) > 1:
            kept[-1] = i
    return np.array(kept)
