"""What frames don't show: where vertices are between them, while whoever plays them goes straight from one to the next.

Joints turn between keys, and vertices on them go in arcs: frames at keys far apart cut these short.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.model import Clip
from anim.skinning.bake import Baker

WIDE_ANGLE_DEG = 0.05  # s; frames closer than this are as close as most clips are made
MAX_SAMPLES = 16  # gaps that are looked into, the widest


class InbetweenError(NamedTuple):
    """How far (m) a vertex is from the middle of its places in the frames before and after, and when (s)."""

    distance: float
    time: float


def inbetween_error(baker: Baker, clip: Clip, times: Floats) -> InbetweenError:
    """Return the most that is missed half-way between frames at `times` (F,) s, increasing, in the widest gaps."""
    gaps = np.diff(times)
    chosen = np.sort(np.argsort(-gaps, kind="stable")[:MAX_SAMPLES])
    chosen = chosen[gaps[chosen] > WIDE_ANGLE_DEG]
    most = InbetweenError(0.0, 0.0)
    if not len(chosen):
        return most
    before, after = times[chosen], times[chosen + 1]
    middle = (before + after) / 2
    three = (baker.bake(clip, times=each).chunks() for each in (before, middle, after))
    for low, half, high in zip(*three, strict=True):
        off = half.positions - (low.positions + high.positions) / 2
        squared = np.einsum("fvi,fvi->fv", off, off).max(axis=1)
        at = int(squared.argmax())
        most = max(most, InbetweenError(float(np.sqrt(squared[at])), float(middle[half.first + at])))
    return most
