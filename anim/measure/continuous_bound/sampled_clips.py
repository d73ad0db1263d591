"""Clips with samples of their distance, divided into steps of a proof."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.measure.error.metric import ErrorSamples
from anim.model import Clip

ALL_BUT_LAST, ALL_BUT_FIRST = slice(-1), slice(1, None)


class SampledClip(NamedTuple):
    """Both versions of a clip, with samples of their distance.

    times: (F,) s, increasing, with all keys of both clips and the last moment before each STEP key, such as those of
    `dense_times`. look: samples at these times.
    """

    before: Clip
    after: Clip
    times: Floats
    look: ErrorSamples


class ClipPart(NamedTuple):
    """Some successive times of one of several clips. number: index of the clip."""

    number: int
    frames: slice


def divide(clips: Sequence[SampledClip], length: int) -> Iterator[list[ClipPart]]:
    """Yield parts of clips that have up to `length` intervals between times together.

    A long clip is divided at every `length` intervals, whatever the others are, so that its bounds are those it has
    alone.
    """
    step: list[ClipPart] = []
    room = length
    for n, clip in enumerate(clips):
        for start in range(0, len(clip.times) - 1, length):
            size = min(length, len(clip.times) - 1 - start)
            if size > room:
                yield step
                step, room = [], length
            step.append(ClipPart(n, slice(start, start + size + 1)))
            room -= size
    if step:
        yield step


def end_limits(
    clips: Sequence[SampledClip], step: Sequence[ClipPart], parts: Sequence[int], player: str
) -> tuple[Floats, Floats]:
    """Return bounds (C, F) of the displacements of groups at both ends of all intervals of a step, in a player.

    parts: indices of the metric's combined parts, whose groups follow each other.
    """
    each = [np.concatenate([clips[part.number].look.limits[player][i][:, part.frames] for i in parts]) for part in step]
    starts, ends = (np.concatenate([one[:, some] for one in each], axis=1) for some in (ALL_BUT_LAST, ALL_BUT_FIRST))
    return starts.astype(np.float64), ends.astype(np.float64)
