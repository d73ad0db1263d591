"""Error of frames: distance of the rotations and translations of a clip from those interpolated between its frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track, ValueKind
from anim.sampling.batch import Batch
from anim.sampling.lazy_batch import batches, lazy_batches

BLOCK_VALUES = 1 << 16  # values compared at a time

Measure: TypeAlias = Callable[[Batch, Floats, Floats], Floats]  # (K, G) of tracks, times of frames (F,) and times (K,)


def frame_error(clip: Clip, times: Floats) -> tuple[float, float]:
    """Return the largest angle in radians, and its time in s: at keys between frames, and half-way between frames.

    times: (F,) s of the frames, increasing. Rotations between them are interpolated by slerp. Keys of STEP tracks are
    compared with the nearer of the two frames: a jump may be late by a frame, but its value has to be in one.
    """
    rotations = [track for track in clip.tracks if track.kind is ValueKind.ROTATION]
    return _largest_of(rotations, times, _slerp_angles, _step_angles)


def translation_error(clip: Clip, times: Floats, lengths: Floats) -> tuple[float, float]:
    """Return the largest distance of a translation in m, and its time in s, as `frame_error` does for rotations.

    lengths: (N,) m per unit of each node's translation.
    """
    translations = [track for track in clip.tracks if track.path == "translation"]

    def in_meters(vectors: Floats, tracks: Batch) -> Floats:
        nodes = [track.node or 0 for track in tracks.tracks]
        return np.asarray(np.linalg.norm(vectors, axis=-1) * lengths[nodes])

    def lerp(tracks: Batch, times: Floats, at: Floats) -> Floats:
        frame, frames = _frames_before(times, at), tracks.sample(times)
        u = ((at - times[frame]) / (times[frame + 1] - times[frame]))[:, None, None]
        return in_meters(frames[frame] * (1 - u) + frames[frame + 1] * u - tracks.sample(at), tracks)

    def step(tracks: Batch, times: Floats, at: Floats) -> Floats:
        frame, frames, values = _frames_before(times, at), tracks.sample(times), tracks.sample(at)
        before, after = (in_meters(frames[k] - values, tracks) for k in (frame, frame + 1))
        return np.minimum(before, after)

    return _largest_of(translations, times, lerp, step)


def _largest_of(tracks: Sequence[Track], times: Floats, smooth: Measure, stepped: Measure) -> tuple[float, float]:
    """The largest error of tracks, and its time; STEP tracks are measured by `stepped`."""
    most = 0.0, float(times[0])
    if len(times) < 2:
        return most
    for stack in lazy_batches(tracks):
        keys = stack.time_axis.times
        inside = keys[(keys > times[0]) & (keys < times[-1])]
        jumps = stack.tracks[0].interpolation is Interpolation.STEP
        at = inside if jumps else np.union1d(inside, (times[1:] + times[:-1]) / 2)
        if not len(at):
            continue
        size = max(BLOCK_VALUES // (len(at) + len(times)), 1)
        for first in range(0, len(stack.tracks), size):
            batch = batches(stack.tracks[first : first + size])[0]
            most = max(most, *_largest(stepped if jumps else smooth, batch, times, at))
    return most


def _largest(measure: Measure, tracks: Batch, times: Floats, at: Floats) -> list[tuple[float, float]]:
    """The largest error of each track, and the first time of it; those of many times in blocks."""
    error, time = np.full(len(tracks.tracks), -1.0), np.zeros(len(tracks.tracks))
    for first in range(0, len(at), BLOCK_VALUES):
        some = at[first : first + BLOCK_VALUES]
        low, high = _frames_before(times, some[[0, -1]])
        errors = measure(tracks, times[low : high + 2], some)
        worst, most = errors.argmax(axis=0), errors.max(axis=0)
        time, error = np.where(most > error, some[worst], time), np.maximum(most, error)
    return list(zip(error.tolist(), time.tolist(), strict=True))


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
