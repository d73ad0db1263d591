"""What frames don't show: where vertices are between them, while whoever plays them goes straight from one to the next.

Joints turn between keys, and vertices on them go in arcs: frames at keys far apart cut these short.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.model import Clip
from anim.skinning.bake import Baker

MIN_INTERVAL_S = 0.05  # shorter intervals are as short as in most clips
MAX_INTERVALS = 16  # the longest, which are sampled
PARTS = 8  # an eased motion is straight at half of an interval, and far from it elsewhere


class InbetweenError(NamedTuple):
    """How far (m) a vertex is from its place on the way straight from the frame before to the next, and when (s)."""

    distance: float
    time: float


def inbetween_error(baker: Baker, clip: Clip, times: Floats) -> InbetweenError:
    """Return the most that is missed between frames at `times` (F,) s, increasing, in the widest gaps.

    Looked at: the ends of seven eighths of each gap, and the last moment before its end, where a STEP track is as far
    off as it jumps. Elsewhere it may be some percent more.
    """
    gaps = np.diff(times)
    chosen = np.sort(np.argsort(-gaps, kind="stable")[:MAX_INTERVALS])
    chosen = chosen[gaps[chosen] > MIN_INTERVAL_S]
    most = InbetweenError(0.0, 0.0)
    if not len(chosen):
        return most
    before, after = times[chosen], times[chosen + 1]
    for part in range(1, PARTS + 1):
        at = np.nextafter(after, before) if part == PARTS else before + (after - before) * (part / PARTS)
        most = max(most, _missed(baker, clip, (before, at, after), part / PARTS))
    return most


def _missed(baker: Baker, clip: Clip, times: tuple[Floats, Floats, Floats], share: float) -> InbetweenError:
    """The most that is missed at the second of three times, that share of the way from the first to the third."""
    most = InbetweenError(0.0, 0.0)
    three = (baker.bake(clip, times=each).chunks() for each in times)
    for low, here, high in zip(*three, strict=True):
        off = here.positions - (low.positions * (1 - share) + high.positions * share)
        squared = np.einsum("fvi,fvi->fv", off, off).max(axis=1)
        frame = int(squared.argmax())
        most = max(most, InbetweenError(float(np.sqrt(squared[frame])), float(times[1][here.first + frame])))
    return most
