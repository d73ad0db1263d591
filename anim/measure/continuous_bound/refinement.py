"""Refinement of the bound: samples in intervals with displacements that may exceed it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.measure.error.displacement import CHUNK, DisplacementField, lengths
from anim.measure.error.metric import MAX_SEARCHED, ErrorMetric
from anim.measure.error.point_groups import PointGroups
from anim.model import Clip

MAX_PARTS = 128  # maximum number of subintervals between two times


class Subintervals(NamedTuple):
    """Intervals between neighboring samples, divided into equal parts, for one player.

    times: (T,) s, ends of parts; the last of an interval is the moment before its end. more: (C, T) m, upper
    bound of the rise of the displacement of a group around each within a part; nan if that interval is not refined.
    tops: (C, T) m, upper bound of the displacement around each, which `refine` sets. interval: (T,) index of each one's
    interval.
    """

    player: str
    times: Floats
    more: Floats
    tops: Floats
    interval: Ints

    def some(self, start: int, end: int) -> Subintervals:
        """Return those with indices from `start` up to `end`, as views."""
        here = slice(max(start, 0), max(end, 0))
        return Subintervals(self.player, self.times[here], self.more[:, here], self.tops[:, here], self.interval[here])


class RefinedMaximum(NamedTuple):
    """The largest sampled displacement in m, its player, and its time in s."""

    largest: float = 0.0
    player: str = ""
    time: float = 0.0


@dataclass(slots=True)
class OpenIntervals:
    """Intervals between neighboring times whose bounds exceed a target, in one player.

    ends: two times (C, F − 1) m, upper bounds of the displacements of C groups at the start and at the end of each
    interval. rise: (C, F − 1) m, upper bounds of their rise above the larger one. is_open: (C, F − 1).
    """

    player: str
    ends: tuple[Floats, Floats]
    rise: Floats
    is_open: Bools

    def num_parts(self, margin: Floats | float) -> Ints:
        """Return the number of parts (F − 1,) in which no displacement rises more than `margin` (C, F − 1) m."""
        rises = np.where(self.is_open, self.rise / margin, 0.0).max(axis=0)
        return np.asarray(np.clip(np.ceil(np.sqrt(rises)), 1, MAX_PARTS), np.int64)

    def margin(self, target: float, least: float) -> Floats:
        """Return how much displacements (C, F − 1) may rise above both ends until they reach the target, in m."""
        return np.maximum(target - np.maximum(*self.ends), least)

    def subdivide(self, times: Floats, parts: Ints, target: float) -> tuple[Subintervals, float]:
        """Return the intervals between `times` (F,) s in `parts` (F − 1,), and the bound in m around unsampled ends.

        An end is sampled only if the bound around it exceeds the target.
        """
        tops = np.stack(self.ends) + self.rise / parts**2
        tops[:, ~self.is_open] = 0.0
        sampled = np.any(tops > target, axis=1)
        bound = float(np.where(sampled[:, None], 0.0, tops).max())
        return subdivide(self.player, times, self.rise, self.is_open, parts, (sampled[0], sampled[1])), bound

    def close(self, parts: Subintervals, target: float, refinable: Bools) -> float:
        """Close intervals whose bound is below the target, and those that are not `refinable` (F − 1,).

        Returns the largest bound of those that are closed, in m.
        """
        self.is_open = np.zeros_like(self.is_open)
        if not len(parts.interval):
            return 0.0
        firsts = np.flatnonzero(np.diff(parts.interval, prepend=-1))
        intervals = parts.interval[firsts]
        tops = np.fmax.reduceat(parts.tops, firsts, axis=1)
        still = (tops > target) & refinable[intervals]
        self.is_open[:, intervals] = still
        return float(np.fmax.reduce(np.where(still, 0.0, tops), axis=None))


def subdivide(
    player: str, times: Floats, rise: Floats, asked: Bools, parts: Ints, sampled: tuple[Bools, Bools] | None = None
) -> Subintervals:
    """Return the intervals between neighbors of `times` (F,) s, divided into `parts` (F − 1,).

    rise: (C, F − 1) m of groups in whole intervals. asked: (C, F − 1), mask of the intervals to refine for each group.
    sampled: (F − 1,) each, whether to sample the starts and the ends of intervals; by default all.
    """
    stretches = np.flatnonzero(asked.any(axis=0))
    counts = parts[stretches] + 1
    whole, stretch = np.repeat(parts[stretches], counts), np.repeat(stretches, counts)
    step = np.arange(len(whole)) - np.repeat(np.cumsum(counts) - counts, counts)
    if sampled is not None:
        kept = ((step > 0) | sampled[0][stretch]) & ((step < whole) | sampled[1][stretch])
        whole, stretch, step = whole[kept], stretch[kept], step[kept]
    start, end = times[stretch], times[stretch + 1]
    at = np.where(step == whole, np.nextafter(end, start), start + (end - start) * (step / whole))
    more = np.where(asked, rise, np.nan)[:, stretch] / whole**2
    return Subintervals(player, at, more, np.full_like(more, np.nan), stretch)


def refine(
    ruler: ErrorMetric,
    clips: tuple[Clip, Clip],
    asked: Sequence[Subintervals],
    parts: Sequence[PointGroups],
    *,
    target: float,
) -> RefinedMaximum:
    """Set `tops` of the subintervals, and return the largest displacement that was sampled.

    asked: of every player. parts: the surfaces of the groups, in order. target: m; vertices of groups with a smaller
    bound are not evaluated.
    """
    seen, left = RefinedMaximum(), MAX_SEARCHED
    for chunk in _chunks(asked, ruler.length):
        old, new = ruler.posed(*clips, [(each.player, each.times) for each in chunk])
        more = np.concatenate([each.more for each in chunk], axis=1)
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
            tops[here], largest, frame, looked = _searched(field, more[here], target, left)
            left -= looked
            if largest > seen.largest:
                players = np.repeat([each.player for each in chunk], [len(each.times) for each in chunk])
                seen = RefinedMaximum(largest, str(players[frame]), float(old.pose.times[frame]))
        ends = np.cumsum([len(each.times) for each in chunk])
        for each, end in zip(chunk, ends.tolist(), strict=True):
            each.tops[:] = tops[:, end - len(each.times) : end]
    return seen


def _chunks(asked: Sequence[Subintervals], length: int) -> Iterator[list[Subintervals]]:
    """Slices of all players' intervals, of up to `length` times together."""
    firsts = np.cumsum([0, *(len(each.times) for each in asked)]).tolist()
    for start in range(0, firsts[-1], length):
        some = (each.some(start - first, start + length - first) for each, first in zip(asked, firsts, strict=False))
        yield [each for each in some if len(each.times)]


def _searched(field: DisplacementField, more: Floats, target: float, most: int) -> tuple[Floats, float, int, int]:
    """Bounds of all groups (G, F), the longest vector, its frame, and the number (≤ `most`) of evaluated ones."""
    tops = field.limits + more
    found, frame, looked = 0.0, 0, 0
    for group in np.flatnonzero((tops > target).any(axis=1)).tolist():
        frames = np.flatnonzero(tops[group] > target)
        vertices = len(field.vectors(group, frames[:1]))
        size = max(CHUNK // max(vertices, 1), 1)
        for some in (frames[i : i + size] for i in range(0, len(frames), size)):
            if looked > most:
                break
            longest = lengths(field, group, some).max(axis=0)
            looked += vertices * len(some)
            tops[group, some] = longest + more[group, some]
            if longest.max() > found:
                found, frame = float(longest.max()), int(some[longest.argmax()])
    return tops, found, frame, looked
