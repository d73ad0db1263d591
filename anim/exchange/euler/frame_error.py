"""Error of frames: angle between the rotations of a clip and those interpolated between its frames."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Clip, Interpolation, ValueKind
from anim.sampling.track import sample


def frame_error(clip: Clip, times: Floats) -> tuple[float, float]:
    """Return the largest angle in radians, and its time in s: at keys between frames, and half-way between frames.

    times: (F,) s of the frames, increasing. Rotations between them are interpolated by slerp. STEP tracks are skipped:
    a format of frames can't hold them.
    """
    most = 0.0, float(times[0])
    if len(times) < 2:
        return most
    for track in clip.tracks:
        if track.kind is not ValueKind.ROTATION or track.interpolation is Interpolation.STEP:
            continue
        inside = track.times[(track.times > times[0]) & (track.times < times[-1])]
        at = np.union1d(inside, (times[1:] + times[:-1]) / 2)
        frame = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
        u = (at - times[frame]) / (times[frame + 1] - times[frame])
        frames = sample(track, times)
        between = quaternion.slerp(frames[frame], frames[frame + 1], u)
        angles = quaternion.angle_between(between, sample(track, at))
        worst = int(angles.argmax())
        most = max(most, (float(angles[worst]), float(at[worst])))
    return most
