"""Frame rate of a clip, and the times of its samples in USD."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.caches.formats.usd_stage import usual_rate
from anim.model import Clip, Interpolation, Track
from anim.sampling.times import frame_times, jump_time_before

MIN_INTERVAL_S = 5e-7  # s; half the shortest jump
MAX_KEY_INTERVAL_S = 0.05  # s; of clips with keys farther apart, the rate of the keys is none of frames


def frame_rate(clip: Clip) -> float | None:
    """Return the first common rate with all keys but the last of a clip on its frames; None for sparse keys or none."""
    keys = clip.key_times
    if len(keys) < 3 or np.diff(keys).max() > MAX_KEY_INTERVAL_S:
        return None
    return usual_rate(keys - keys[0])


def sample_times(clip: Clip, fps: float, *, with_keys: bool = False) -> Floats:
    """Return the times (F,) s of samples: frames at a rate, and both sides of the jumps of STEP tracks.

    with_keys: all keys too.
    """
    frames = frame_times(clip.start, clip.end, fps=fps)
    jumps = np.unique(np.concatenate([np.empty(0), *map(_jump_times, clip.tracks)]))
    jumps = jumps[np.append(np.diff(jumps) > MIN_INTERVAL_S, True)[: len(jumps)]]
    found = np.union1d(jump_time_before(jumps), jumps)
    # A frame that rounding puts just before a jump would have the value of before it, up to the next frame.
    found = add_times(found, frames)
    return add_times(found, clip.key_times) if with_keys else found


def add_times(times: Floats, more: Floats) -> Floats:
    """Return sorted times (F,) s with those of `more` that differ from all of them by more than rounding."""
    if not len(times):
        return more
    after = np.searchsorted(times, more)
    nearest = np.minimum(
        np.abs(more - times[np.maximum(after - 1, 0)]), np.abs(times[np.minimum(after, len(times) - 1)] - more)
    )
    return np.union1d(times, more[nearest > MIN_INTERVAL_S])


def _jump_times(track: Track) -> Floats:
    """Times of keys at which a STEP track changes."""
    if track.interpolation is not Interpolation.STEP:
        return np.empty(0)
    changed = (np.diff(track.values, axis=0) != 0).any(axis=1)
    return np.asarray(track.times[1:][changed])
