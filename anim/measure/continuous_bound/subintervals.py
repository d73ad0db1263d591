"""Intervals between samples, and their subdivision where displacements may exceed a target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints

MAX_PARTS = 128  # maximum number of subintervals between two times


class TimeIntervals(NamedTuple):
    """Intervals between neighboring times of clips, those of one after those of another.

    starts, ends: (F,) s. clip: (F,) index of each one's clip.
    """

    starts: Floats
    ends: Floats
    clip: Ints


def join_intervals(times: Sequence[Floats]) -> TimeIntervals:
    """Return the intervals between the times of each clip, in s, increasing."""
    counts = [len(each) - 1 for each in times]
    starts, ends = (np.concatenate([each[some] for each in times]) for some in (slice(-1), slice(1, None)))
    return TimeIntervals(starts, ends, np.repeat(np.arange(len(times)), counts))


class Subintervals(NamedTuple):
    """Intervals between neighboring samples, divided into equal parts, for one player.

    times: (T,) s, ends of parts; the last of an interval is the moment before its end. more: (C, T) m, upper
    bound of the rise of the displacement of a group around each within a part; nan if that interval is not refined.
    tops: (C, T) m, upper bound of the displacement around each, which `refine` sets. interval, clip: (T,)
    indices of each one's interval and clip.
    """

    player: str
    times: Floats
    more: Floats
    tops: Floats
    interval: Ints
    clip: Ints

    def some(self, start: int, end: int) -> Subintervals:
        """Return those with indices from `start` up to `end`, as views."""
        here = slice(max(start, 0), max(end, 0))
        return Subintervals(
            self.player,
            self.times[here],
            self.more[:, here],
            self.tops[:, here],
            self.interval[here],
            self.clip[here],
        )


@dataclass(slots=True)
class OpenIntervals:
    """Intervals between neighboring times whose bounds exceed a target, in one player.

    ends: two times (C, F) m, upper bounds of the displacements of C groups at the start and at the end of each
    interval. rise: (C, F) m, upper bounds of their rise above the larger one. is_open: (C, F).
    """

    player: str
    ends: tuple[Floats, Floats]
    rise: Floats
    is_open: Bools

    def num_parts(self, margin: Floats | float) -> Ints:
        """Return the number of parts (F,) in which no displacement rises more than `margin` (C, F) or (F,) m."""
        open_rise = np.where(self.is_open, self.rise, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):  # no margin where the scene has no size: parts at most
            rises = np.where(open_rise > 0, open_rise / margin, 0.0).max(axis=0)
        return np.asarray(np.clip(np.ceil(np.sqrt(rises)), 1, MAX_PARTS), np.int64)

    def margin(self, target: Floats | float, least: Floats | float) -> Floats:
        """Return how much displacements (C, F) may rise above both ends until they reach the target (F,), in m."""
        return np.maximum(target - np.maximum(*self.ends), least)

    def subdivide(self, where: TimeIntervals, parts: Ints, target: Floats | float) -> tuple[Subintervals, Floats]:
        """Return the intervals in `parts` (F,), and the bounds (F,) in m around unsampled ends.

        An end is sampled only if the bound around it exceeds the target (F,).
        """
        tops = np.stack(self.ends) + self.rise / parts**2
        tops[:, ~self.is_open] = 0.0
        sampled = np.any(tops > target, axis=1)
        bound = np.where(sampled[:, None], 0.0, tops).max(axis=(0, 1))
        return subdivide(self.player, where, self.rise, self.is_open, parts, (sampled[0], sampled[1])), bound

    def close(self, parts: Subintervals, target: Floats, refinable: Bools) -> Floats:
        """Close intervals whose bound is below the target (F,), and those that are not `refinable` (F,).

        Returns the bounds (F,) of those that are closed, in m.
        """
        self.is_open, bounds = np.zeros_like(self.is_open), np.zeros(self.is_open.shape[1])
        if not len(parts.interval):
            return bounds
        firsts = np.flatnonzero(np.diff(parts.interval, prepend=-1))
        intervals = parts.interval[firsts]
        tops = np.fmax.reduceat(parts.tops, firsts, axis=1)
        still = (tops > target[intervals]) & refinable[intervals]
        self.is_open[:, intervals] = still
        bounds[intervals] = np.fmax.reduce(np.where(still, 0.0, tops), axis=0, initial=0.0)
        return bounds


def subdivide(
    player: str,
    where: TimeIntervals,
    rise: Floats,
    asked: Bools,
    parts: Ints,
    sampled: tuple[Bools, Bools] | None = None,
) -> Subintervals:
    """Return the intervals (F,) divided into `parts` (F,).

    rise: (C, F) m of groups in whole intervals. asked: (C, F), mask of the intervals to refine for each group.
    sampled: (F,) each, whether to sample the starts and the ends of intervals; by default all.
    """
    stretches = np.flatnonzero(asked.any(axis=0))
    counts = parts[stretches] + 1
    whole, stretch = np.repeat(parts[stretches], counts), np.repeat(stretches, counts)
    step = np.arange(len(whole)) - np.repeat(np.cumsum(counts) - counts, counts)
    if sampled is not None:
        kept = ((step > 0) | sampled[0][stretch]) & ((step < whole) | sampled[1][stretch])
        whole, stretch, step = whole[kept], stretch[kept], step[kept]
    start, end = where.starts[stretch], where.ends[stretch]
    at = np.where(step == whole, np.nextafter(end, start), start + (end - start) * (step / whole))
    more = np.where(asked, rise, np.nan)[:, stretch] / whole**2
    return Subintervals(player, at, more, np.full_like(more, np.nan), stretch, where.clip[stretch])
