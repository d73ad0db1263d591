"""Inter-frame error of a bake: distance between the motion and linear interpolation of frames.

Joints rotate between keys, and their vertices follow arcs: frames at keys far apart cut these short.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Clip
from anim.skinning.bake import Baker

DENSE_INTERVAL_S = 0.05  # in intervals up to this the error is largest about half-way, or at a jump
MAX_INTERVALS = 16  # the widest intervals only
EQUAL_TOLERANCE = 0.01  # of the width of intervals, as a fraction
NUM_PARTS = 8  # samples per interval: an eased motion has no error half-way, but elsewhere


class InbetweenError(NamedTuple):
    """Largest distance (m) of a vertex from linear interpolation between frames, and its time (s)."""

    distance: float
    time: float


def inbetween_error(baker: Baker, clip: Clip, times: Floats) -> InbetweenError:
    """Return the largest inter-frame error between frames at `times` (F,) s, increasing.

    Sampled in the widest intervals, at the ends of seven eighths of each, and just before its end, where a STEP track
    has its full error; short intervals half-way and there. Of equal intervals some are sampled, evenly over the clip.
    Elsewhere the error may be more.
    """
    gaps = np.diff(times)
    chosen = _widest(gaps)
    is_dense = gaps[chosen] <= DENSE_INTERVAL_S
    wide = _sampled_error(baker, clip, times, chosen[~is_dense], range(1, NUM_PARTS + 1))
    return max(wide, _sampled_error(baker, clip, times, chosen[is_dense], (NUM_PARTS // 2, NUM_PARTS)))


def _widest(gaps: Floats) -> Ints:
    """Indices of the widest intervals; of those about as wide as the last one, some that are evenly distributed."""
    if len(gaps) <= MAX_INTERVALS:
        return np.arange(len(gaps))
    limit = np.sort(gaps)[-MAX_INTERVALS]
    is_wider = gaps > limit * (1 + EQUAL_TOLERANCE)
    equal = np.flatnonzero(~is_wider & (gaps >= limit * (1 - EQUAL_TOLERANCE)))
    count = min(len(equal), MAX_INTERVALS - int(is_wider.sum()))
    some = equal[np.linspace(0, len(equal) - 1, count).round().astype(int)]
    return np.sort(np.concatenate((np.flatnonzero(is_wider), some)))


def _sampled_error(baker: Baker, clip: Clip, times: Floats, chosen: Ints, parts: Sequence[int]) -> InbetweenError:
    """Largest error in the chosen intervals, at the ends of these parts of each."""
    most = InbetweenError(0.0, 0.0)
    if not len(chosen):
        return most
    before, after = times[chosen], times[chosen + 1]
    for part in parts:
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
