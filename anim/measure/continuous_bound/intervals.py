"""Time intervals in which every track of two clips is one smooth segment."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints, unique_sorted
from anim.model import Clip, TimeAxis

MAX_UNSPLIT_S = 0.05  # s; longer intervals are split at all samples, for a bound per part


class Intervals:
    """G intervals. edges: (G + 1,) s, increasing."""

    def __init__(self, edges: Floats) -> None:
        self.edges = edges
        self._placed: dict[TimeAxis, IntervalKeys] = {}

    @property
    def starts(self) -> Floats:
        """Start times (G,), in s."""
        return self.edges[:-1]

    @property
    def ends(self) -> Floats:
        """End times (G,), in s."""
        return self.edges[1:]

    @property
    def lengths(self) -> Floats:
        """Lengths (G,), in s."""
        return np.diff(self.edges)

    def __len__(self) -> int:
        return len(self.edges) - 1

    @property
    def first(self) -> Intervals:
        """The first interval alone."""
        return Intervals(self.edges[:2])

    def on(self, keys: TimeAxis) -> IntervalKeys:
        """Return the intervals' positions on keys (K,)."""
        if keys not in self._placed:
            self._placed[keys] = interval_keys(keys.times, self)
        return self._placed[keys]

    def number(self, at: Floats) -> Ints:
        """Return the indices of the intervals (F,) that contain times `at` (F,) in s, or start there."""
        return np.clip(np.searchsorted(self.edges, at, side="right") - 1, 0, max(len(self) - 1, 0))


class IntervalKeys(NamedTuple):
    """Intervals on the keys of one time axis.

    left, right: (G,) keys of the segment. start, end: (G,) interpolation parameters, both 0 outside the keys. duration:
    (G,) s from left to right. inside: (G,) whether the interval is between keys.
    """

    left: Ints
    right: Ints
    start: Floats
    end: Floats
    duration: Floats
    inside: Bools


def merge_intervals(times: Floats, *clips: Clip, longest: float = MAX_UNSPLIT_S) -> Intervals:
    """Return the intervals between all keys of the clips; long ones are split at `times` (F,) in s.

    The first starts at the first of the times, the last ends at the last of them. times: increasing, with all keys that
    are between them. longest: s, intervals up to this duration are not split.
    """
    axes = dict.fromkeys(axis for clip in clips for axis in clip.time_axes)
    within = [each.times[slice(*np.searchsorted(each.times, times[[0, -1]]))] for each in axes]
    keys = unique_sorted(np.concatenate([times[:1], *within, times[-1:]]))
    lengths = np.diff(keys)
    if not len(lengths):
        return Intervals(keys)
    interval = np.clip(np.searchsorted(keys, times, side="right") - 1, 0, len(lengths) - 1)
    return Intervals(unique_sorted(np.concatenate((keys, times[lengths[interval] > longest]))))


def interval_keys(keys: Floats, where: Intervals) -> IntervalKeys:
    """Return the positions of intervals on keys (K,) in s."""
    last = len(keys) - 1
    left = np.clip(np.searchsorted(keys, where.starts, side="right") - 1, 0, last)
    right = np.minimum(left + 1, last)
    duration = keys[right] - keys[left]
    inside = (where.starts >= keys[left]) & (duration > 0)
    whole = np.where(inside, duration, 1.0)
    start = np.where(inside, (where.starts - keys[left]) / whole, 0.0)
    end = np.where(inside, np.minimum((where.ends - keys[left]) / whole, 1.0), 0.0)
    return IntervalKeys(left, right, start, end, duration, inside)
