"""Error of frames: angle between the rotations of a clip and those interpolated between its frames."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track, ValueKind
from anim.sampling.track import sample


def frame_error(clip: Clip, times: Floats) -> tuple[float, float]:
    """Return the largest angle in radians, and its time in s: at keys between frames, and half-way between frames.

    times: (F,) s of the frames, increasing. Rotations between them are interpolated by slerp. Keys of STEP tracks are
    compared with the nearer of the two frames: a jump may be late by a frame, but its value has to be in one.
    """
    most = 0.0, float(times[0])
    if len(times) < 2:
        return most
    for track in clip.tracks:
        if track.kind is not ValueKind.ROTATION:
            continue
        inside = track.times[(track.times > times[0]) & (track.times < times[-1])]
        stepped = track.interpolation is Interpolation.STEP
        at = inside if stepped else np.union1d(inside, (times[1:] + times[:-1]) / 2)
        if not len(at):
            continue
        angles = (_step_angles if stepped else _slerp_angles)(track, times, at)
        worst = int(angles.argmax())
        most = max(most, (float(angles[worst]), float(at[worst])))
    return most


def _slerp_angles(track: Track, times: Floats, at: Floats) -> Floats:
    """Return the angles (K,) between the track and the slerp of its frames."""
    frame, frames = _frames_before(times, at), sample(track, times)
    u = (at - times[frame]) / (times[frame + 1] - times[frame])
    between = quaternion.slerp(frames[frame], frames[frame + 1], u)
    return quaternion.angle_between(between, sample(track, at))


def _step_angles(track: Track, times: Floats, at: Floats) -> Floats:
    """Return the angles (K,) between the track and the nearer of the frames before and after."""
    frame, frames, values = _frames_before(times, at), sample(track, times), sample(track, at)
    before, after = (quaternion.angle_between(frames[k], values) for k in (frame, frame + 1))
    return np.minimum(before, after)


def _frames_before(times: Floats, at: Floats) -> Ints:
    """Return the index (K,) of the frame at or before each time, never the last."""
    return np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
