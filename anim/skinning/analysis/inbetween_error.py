"""Inter-frame error of a bake: distance between the motion and linear interpolation of frames.

Joints rotate between keys, and their vertices follow arcs: frames at keys far apart cut these short.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.model import Clip
from anim.skinning.bake import Baker

MIN_INTERVAL_S = 0.05  # frames closer than this are as dense as in most clips
MAX_INTERVALS = 16  # the widest intervals only
NUM_PARTS = 8  # samples per interval: an eased motion has no error half-way, but elsewhere


class InbetweenError(NamedTuple):
    """Largest distance (m) of a vertex from linear interpolation between frames, and its time (s)."""

    distance: float
    time: float


def inbetween_error(baker: Baker, clip: Clip, times: Floats) -> InbetweenError:
    """Return the largest inter-frame error between frames at `times` (F,) s, increasing.

    Sampled in the widest intervals, at the ends of seven eighths of each, and just before its end, where a STEP track
    has its full error. Elsewhere it may be some percent more.
    """
    gaps = np.diff(times)
    chosen = np.sort(np.argsort(-gaps, kind="stable")[:MAX_INTERVALS])
    chosen = chosen[gaps[chosen] > MIN_INTERVAL_S]
    most = InbetweenError(0.0, 0.0)
    if not len(chosen):
        return most
    before, after = times[chosen], times[chosen + 1]
    for part in range(1, NUM_PARTS + 1):
        at = np.nextafter(after, before) if part == NUM_PARTS else before + (after - before) * (part / NUM_PARTS)
        most = max(most, _error_at(baker, clip, (before, at, after), part / NUM_PARTS))
    return most


def _error_at(baker: Baker, clip: Clip, times: tuple[Floats, Floats, Floats], u: float) -> InbetweenError:
    """The error at the second of three times, at fraction `u` from the first to the third."""
    most = InbetweenError(0.0, 0.0)
    three = (baker.bake(clip, times=each).chunks() for each in times)
    for low, here, high in zip(*three, strict=True):
        error = here.positions - (low.positions * (1 - u) + high.positions * u)
        squared = np.einsum("fvi,fvi->fv", error, error).max(axis=1)
        frame = int(squared.argmax())
        most = max(most, InbetweenError(float(np.sqrt(squared[frame])), float(times[1][here.first + frame])))
    return most
