"""Error of frames: angle between the rotations of a clip and those interpolated between its frames."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import quaternion
from anim.model import Clip, Interpolation, ValueKind
from anim.sampling.batch import Batch
from anim.sampling.lazy_batch import batches, lazy_batches

BLOCK_VALUES = 1 << 16  # rotations compared at a time


def frame_error(clip: Clip, times: Floats) -> tuple[float, float]:
    """Return the largest angle in radians, and its time in s: at keys between frames, and half-way between frames.

    times: (F,) s of the frames, increasing. Rotations between them are interpolated by slerp. Keys of STEP tracks are
    compared with the nearer of the two frames: a jump may be late by a frame, but its value has to be in one.
    """
    most = 0.0, float(times[0])
    if len(times) < 2:
        return most
    rotations = [track for track in clip.tracks if track.kind is ValueKind.ROTATION]
    for stack in lazy_batches(rotations):
        keys = stack.time_axis.times
        inside = keys[(keys > times[0]) & (keys < times[-1])]
        stepped = stack.tracks[0].interpolation is Interpolation.STEP
        at = inside if stepped else np.union1d(inside, (times[1:] + times[:-1]) / 2)
        if not len(at):
            continue
        size = max(BLOCK_VALUES // (len(at) + len(times)), 1)
        for first in range(0, len(stack.tracks), size):
            batch = batches(stack.tracks[first : first + size])[0]
            most = max(most, *_largest(_step_angles if stepped else _slerp_angles, batch, times, at))
    return most


def _largest(
    measure: Callable[[Batch, Floats, Floats], Floats], tracks: Batch, times: Floats, at: Floats
) -> list[tuple[float, float]]:
    """The largest angle of each track, and the first time of it; those of many times in blocks."""
    angle, time = np.full(len(tracks.tracks), -1.0), np.zeros(len(tracks.tracks))
    for first in range(0, len(at), BLOCK_VALUES):
        some = at[first : first + BLOCK_VALUES]
        low, high = _frames_before(times, some[[0, -1]])
        angles = measure(tracks, times[low : high + 2], some)
        worst, most = angles.argmax(axis=0), angles.max(axis=0)
        time, angle = np.where(most > angle, some[worst], time), np.maximum(most, angle)
    return list(zip(angle.tolist(), time.tolist(), strict=True))


def _slerp_angles(tracks: Batch, times: Floats, at: Floats) -> Floats:
    """Return the angles (K, G) between the tracks and the slerp of their frames."""
    frame, frames = _frames_before(times, at), tracks.sample(times)
    u = (at - times[frame]) / (times[frame + 1] - times[frame])
    between = quaternion.slerp(frames[frame], frames[frame + 1], u[:, None])
    return quaternion.angle_between(between, tracks.sample(at))


def _step_angles(tracks: Batch, times: Floats, at: Floats) -> Floats:
    """Return the angles (K, G) between the tracks and the nearer of the frames before and after."""
    frame, frames, values = _frames_before(times, at), tracks.sample(times), tracks.sample(at)
    before, after = (quaternion.angle_between(frames[k], values) for k in (frame, frame + 1))
    return np.minimum(before, after)


def _frames_before(times: Floats, at: Floats) -> Ints:
    """Return the index (K,) of the frame at or before each time, never the last."""
    return np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
