"""Tracks of one time axis stacked into one array, so that the cost per numpy call occurs once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import TimeAxis, Track
from anim.sampling.alike import Rule, Tangents, TrackGroup, rule, stack_values
from anim.sampling.track import KeyInterval, find_interval, interpolate


@dataclass(frozen=True, slots=True)
class Batch(TrackGroup):
    """G tracks of one rule with the same times.

    values: (K, G, C). tangents: in and out, both (K, G, C) per second, for CUBICSPLINE.
    """

    time_axis: TimeAxis
    values: Floats
    tangents: Tangents | None

    @property
    def times(self) -> Floats:
        """Key times (K,) in seconds."""
        return self.time_axis.times

    def sample(self, at: Floats, place: KeyInterval | None = None) -> Floats:
        """Return the values (F, G, C) at times `at` (F,); a known `place` saves its search."""
        place = place or find_interval(self.times, at)
        return interpolate(place, self.values, self.tangents, self.interpolation, self.kind)


class LazyBatch:
    """Tracks of one rule with the same times, with keys stacked on demand.

    All keys are stacked once half of them are requested in one call, or twice as many in all calls together. Before,
    only the requested ones are: a long clip sampled from start to end is not in memory twice, and starts sooner.
    """

    def __init__(self, tracks: tuple[Track, ...], numbers: Ints) -> None:
        self.tracks, self.numbers = tracks, numbers
        self.time_axis = tracks[0].time_axis
        self._stacked = 0
        self._whole: Batch | None = None

    @property
    def whole(self) -> Batch:
        """All keys."""
        if self._whole is None:
            values, tangents = stack_values(self.tracks, partial(np.stack, axis=1))
            self._whole = Batch(self.tracks, self.numbers, self.time_axis, values, tangents)
        return self._whole

    def at(self, place: KeyInterval) -> tuple[Batch, KeyInterval]:
        """Return a batch with the keys of `place`, and `place` relative to that batch."""
        low, high = (int(place.left.min()), int(place.right.max()) + 1) if len(place.left) else (0, 1)
        self._stacked += high - low
        keys = len(self.time_axis)
        if self._whole is not None or 2 * (high - low) >= keys or self._stacked > 2 * keys:
            return self.whole, place
        joined = stack_values(self.tracks, lambda each: np.stack([values[low:high] for values in each], axis=1))
        moved = replace(place, left=place.left - low, right=place.right - low)
        return Batch(self.tracks, self.numbers, TimeAxis(self.time_axis.times[low:high]), *joined), moved


def lazy_batches(tracks: Iterable[Track]) -> list[LazyBatch]:
    """Return `tracks` grouped by time axis and `alike.rule`, in the order of their first members."""
    tracks, groups = tuple(tracks), dict[tuple[TimeAxis, Rule], list[int]]()
    for i, track in enumerate(tracks):
        groups.setdefault((track.time_axis, rule(track)), []).append(i)
    return [LazyBatch(tuple(tracks[i] for i in group), np.array(group)) for group in groups.values()]


def batches(tracks: Iterable[Track]) -> list[Batch]:
    """Return `tracks` stacked by the groups of `lazy_batches`."""
    return [each.whole for each in lazy_batches(tracks)]
