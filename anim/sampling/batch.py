"""Tracks that share a time axis, stacked so that numpy's cost per call is paid once for all of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from anim.arrays import Floats
from anim.model import Track
from anim.sampling.alike import Rule, Tangents, TrackGroup, rule, stack_values
from anim.sampling.track import KeyInterval, find_interval, interpolate


@dataclass(frozen=True, slots=True)
class Batch(TrackGroup):
    """G tracks of one rule and with the same times.

    times: (K,) s. values: (K, G, C). tangents: in and out, both (K, G, C) per second, for CUBICSPLINE.
    """

    times: Floats
    values: Floats
    tangents: Tangents | None

    def sample(self, at: Floats, place: KeyInterval | None = None) -> Floats:
        """Return the values (F, G, C) at times `at` (F,); `place` saves the look-up where it is known."""
        place = place or find_interval(self.times, at)
        return interpolate(place, self.values, self.tangents, self.interpolation, self.kind)


class LazyBatch:
    """Tracks of one rule and with the same times, whose keys are stacked when they are needed.

    That is all keys at once where half of them are, or where parts have been asked for that are twice as many together;
    else only those: a long clip that is played from start to end isn't in memory twice, and begins sooner.
    """

    def __init__(self, tracks: tuple[Track, ...]) -> None:
        self.tracks = tracks
        self.times = tracks[0].times
        self._stacked = 0
        self._whole: Batch | None = None

    @property
    def whole(self) -> Batch:
        """All keys."""
        if self._whole is None:
            self._whole = Batch(self.tracks, self.times, *stack_values(self.tracks, partial(np.stack, axis=1)))
        return self._whole

    def at(self, place: KeyInterval) -> tuple[Batch, KeyInterval]:
        """Return a batch of keys among which are those of `place`, and where in it they are."""
        low, high = (int(place.left.min()), int(place.right.max()) + 1) if len(place.left) else (0, 0)
        self._stacked += high - low
        keys = len(self.times)
        if self._whole is not None or 2 * (high - low) >= keys or self._stacked > 2 * keys:
            return self.whole, place
        joined = stack_values(self.tracks, lambda each: np.stack([values[low:high] for values in each], axis=1))
        moved = replace(place, left=place.left - low, right=place.right - low)
        return Batch(self.tracks, self.times[low:high], *joined), moved


def lazy_batches(tracks: Iterable[Track]) -> list[LazyBatch]:
    """Return `tracks` by time axis and `alike.rule`, in the order of their first members.

    Time axes are the same where they are one array: tracks read from one input accessor share it.
    """
    groups: dict[tuple[int, Rule], list[Track]] = {}
    for track in tracks:
        groups.setdefault((id(track.times), rule(track)), []).append(track)
    return [LazyBatch(tuple(group)) for group in groups.values()]


def batches(tracks: Iterable[Track]) -> list[Batch]:
    """Return `tracks` stacked as `stacks` sorts them."""
    return [each.whole for each in lazy_batches(tracks)]
