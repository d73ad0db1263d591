"""Refinement of the bound: samples in intervals with displacements that may exceed it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.measure.continuous_bound.subintervals import Subintervals
from anim.measure.error.displacement import CHUNK, DisplacementField
from anim.measure.error.max_displacement import lengths
from anim.measure.error.metric import MAX_SEARCHED, ErrorMetric
from anim.measure.error.point_groups import PointGroups
from anim.measure.error.posed_clips import AskedTimes, has_weights
from anim.model import Clip


class RefinedMaximum(NamedTuple):
    """The largest sampled displacement in m, its player, and its time in s."""

    largest: float = 0.0
    player: str = ""
    time: float = 0.0


def refine(
    ruler: ErrorMetric,
    clips: Sequence[tuple[Clip, Clip]],
    asked: Sequence[Subintervals],
    parts: Sequence[PointGroups],
    *,
    target: Floats,
) -> list[RefinedMaximum]:
    """Set `tops` of the subintervals, and return the largest displacement that was sampled of each clip.

    clips: before and after. asked: of every player. parts: the surfaces of the groups, in order. target: (F,) m of each
    interval; vertices of groups with a smaller bound are not evaluated.
    """
    seen = [RefinedMaximum() for _ in clips]
    vertices = sum(len(group) for part in parts for group in part.groups)
    alone = [has_weights(*pair) for pair in clips]
    for group in _groups(asked, alone, min(ruler.length, MAX_SEARCHED // max(vertices, 1))):
        left = MAX_SEARCHED  # groups of several clips have fewer, so that none takes from another
        for chunk in _chunks(group, ruler.length):
            old, new = ruler.posed(clips, [AskedTimes(each.player, each.times, each.clip) for each in chunk])
            more = np.concatenate([each.more for each in chunk], axis=1)
            limit = target[np.concatenate([each.interval for each in chunk])]
            tops = np.full_like(more, np.nan)
            first = 0
            for part in parts:
                here = slice(first, first + len(part.groups))
                first += len(part.groups)
                if np.isnan(more[here]).all():
                    continue
                field = part.field(old, new)
                if field is None:
                    continue
                tops[here], found = _searched(field, more[here], limit, left)
                left -= found.num_evaluated
                _update(seen, found.longest, chunk)
            ends = np.cumsum([len(each.times) for each in chunk])
            for each, end in zip(chunk, ends.tolist(), strict=True):
                each.tops[:] = tops[:, end - len(each.times) : end]
    return seen


def _groups(asked: Sequence[Subintervals], alone: Sequence[bool], length: int) -> Iterator[list[Subintervals]]:
    """Slices of all players' intervals, those of one clip, or of several with up to `length` times together.

    alone: whether a clip is in no group of several: bounds of its morphed surfaces depend on the other times.
    """
    numbers = np.arange(len(alone) + 1)
    firsts = np.array([np.searchsorted(each.clip, numbers) for each in asked])
    counts = np.diff(firsts.sum(axis=0)).tolist()
    starts = [0]
    room = length - counts[0]
    for n in range(1, len(counts)):
        if counts[n] > room or alone[n] or alone[n - 1]:
            starts.append(n)
            room = length
        room -= counts[n]
    for start, end in zip(starts, [*starts[1:], len(counts)], strict=True):
        yield [each.some(row[start], row[end]) for each, row in zip(asked, firsts.tolist(), strict=True)]


def _chunks(asked: Sequence[Subintervals], length: int) -> Iterator[list[Subintervals]]:
    """Slices of all players' intervals, of up to `length` times together."""
    firsts = np.cumsum([0, *(len(each.times) for each in asked)]).tolist()
    for start in range(0, firsts[-1], length):
        some = (each.some(start - first, start + length - first) for each, first in zip(asked, firsts, strict=False))
        yield [each for each in some if len(each.times)]


class _Evaluated(NamedTuple):
    """The longest vectors (G, F) of groups, 0 where none were evaluated, and the number of those that were."""

    longest: Floats
    num_evaluated: int


def _searched(field: DisplacementField, more: Floats, target: Floats, most: int) -> tuple[Floats, _Evaluated]:
    """Bounds of all groups (G, F), and evaluated vectors, about `most` of them. target: (F,) m."""
    tops = field.limits + more
    found, looked = np.zeros(tops.shape), 0
    for group in np.flatnonzero((tops > target).any(axis=1)).tolist():
        frames = np.flatnonzero(tops[group] > target)
        vertices = len(field.vectors(group, frames[:1]))
        size = max(CHUNK // max(vertices, 1), 1)
        for some in (frames[i : i + size] for i in range(0, len(frames), size)):
            if looked > most:
                break
            found[group, some] = lengths(field, group, some).max(axis=0)
            looked += vertices * len(some)
            tops[group, some] = found[group, some] + more[group, some]
    return tops, _Evaluated(found, looked)


def _update(seen: list[RefinedMaximum], longest: Floats, chunk: Sequence[Subintervals]) -> None:
    """Replace the maxima of clips by larger ones among displacements (G, F) of a chunk's times."""
    clip: Ints = np.concatenate([each.clip for each in chunk])
    times = np.concatenate([each.times for each in chunk])
    players = np.repeat(np.arange(len(chunk)), [len(each.times) for each in chunk])
    for n in sorted(set(clip.tolist())):
        frames = np.flatnonzero(clip == n)
        own = longest[:, frames]
        frame = frames[own.argmax() % len(frames)]
        if own.max() > seen[n].largest:
            seen[n] = RefinedMaximum(float(own.max()), chunk[players[frame]].player, float(times[frame]))
