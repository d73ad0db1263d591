"""Tracks grouped by rule and time axis, with keys stacked when they are requested."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import compress

import numpy as np

from anim.arrays import Bools, Ints
from anim.model import Interpolation, TimeAxis, Track
from anim.sampling.batch import Batch, MixedBatch, Rule, rule_of, stack_values

MAX_STACKED_KEYS = 1 << 18  # of the tracks of one axis; of more only those requested are stacked, call by call


class LazyBatch:
    """Tracks of one rule with the same times, with keys stacked on demand.

    All keys are stacked once half of them are requested in one call, or twice as many in all calls together. Before,
    and of more than MAX_STACKED_KEYS, only the requested ones are: a long clip is not in memory twice.
    """

    def __init__(self, tracks: tuple[Track, ...], numbers: Ints, stacked: Batch | None = None) -> None:
        """stacked: all keys, if they are already."""
        self.tracks, self.numbers = tracks, numbers
        self.time_axis = (stacked or tracks[0]).time_axis
        self.is_long = len(self.time_axis) * len(tracks) > MAX_STACKED_KEYS
        self._stacked = 0
        self._whole = stacked

    @property
    def path(self) -> str:
        """Path of all tracks."""
        return self.tracks[0].path

    @property
    def is_cubic(self) -> bool:
        """True for tracks with tangents."""
        return self.tracks[0].interpolation is Interpolation.CUBICSPLINE

    @property
    def whole(self) -> Batch:
        """All keys."""
        if self._whole is None:
            self._whole = self._stack(slice(None), self.time_axis)
        return self._whole

    def at(self, left: Ints, right: Ints) -> tuple[Batch, Ints, Ints]:
        """Return a batch with these keys (F,) at least, and their indices in it."""
        low, high = (int(left.min()), int(right.max()) + 1) if len(left) else (0, 1)
        if not self.is_long:
            self._stacked += high - low
            keys = len(self.time_axis)
            if self._whole is not None or 2 * (high - low) >= keys or self._stacked > 2 * keys:
                return self.whole, left, right
        elif high - low > 2 * len(left):
            used, found = np.unique(np.concatenate((left, right)), return_inverse=True)
            first, second = np.split(found, 2)
            return self._stack(used, TimeAxis(self.time_axis.times[used])), first, second
        return self._stack(slice(low, high), TimeAxis(self.time_axis.times[low:high])), left - low, right - low

    def pick(self, chosen: Bools) -> LazyBatch:
        """Return the chosen (G,) of the tracks."""
        if chosen.all():
            return self
        stacked = self._whole and self._whole.pick(chosen)
        return LazyBatch(tuple(compress(self.tracks, chosen.tolist())), self.numbers[chosen], stacked)

    def first_key(self) -> LazyBatch:
        """Return the tracks with their first keys only."""
        axis = TimeAxis(self.time_axis.times[:1])
        return LazyBatch(self.tracks, self.numbers, self._stack(slice(1), axis))

    def _stack(self, keys: slice | Ints, axis: TimeAxis) -> Batch:
        if self._whole is not None:
            return self._whole.take(keys, axis)
        joined = stack_values(self.tracks, lambda each: np.stack([values[keys] for values in each], axis=1))
        return Batch(self.tracks, self.numbers, axis, *joined)


def mixed_batches(tracks: Iterable[Track]) -> tuple[list[LazyBatch], list[MixedBatch]]:
    """Return `tracks` grouped by rule: those of one time axis, and those of several.

    Those of more than MAX_STACKED_KEYS keys are grouped by time axis too.
    """
    tracks, groups = tuple(tracks), dict[Rule, list[int]]()
    for i, track in enumerate(tracks):
        groups.setdefault(rule_of(track), []).append(i)
    single, mixed = [], []
    for group in groups.values():
        chosen = tuple(tracks[i] for i in group)
        axes = tuple(dict.fromkeys(track.time_axis for track in chosen))
        counts = np.array([len(track.values) for track in chosen])
        if len(axes) == 1 or counts.sum() > MAX_STACKED_KEYS:
            single += [LazyBatch(each.tracks, np.array(group)[each.numbers]) for each in lazy_batches(chosen)]
            continue
        index = {axis: i for i, axis in enumerate(axes)}
        axis_of = np.array([index[track.time_axis] for track in chosen])
        joined = stack_values(chosen, np.concatenate)
        mixed.append(MixedBatch(chosen, np.array(group), axes, axis_of, np.cumsum(counts) - counts, *joined))
    return single, mixed


def lazy_batches(tracks: Iterable[Track]) -> list[LazyBatch]:
    """Return `tracks` grouped by time axis and rule, in the order of their first members."""
    tracks, groups = tuple(tracks), dict[tuple[TimeAxis, Rule], list[int]]()
    for i, track in enumerate(tracks):
        groups.setdefault((track.time_axis, rule_of(track)), []).append(i)
    return [LazyBatch(tuple(tracks[i] for i in group), np.array(group)) for group in groups.values()]


def batches(tracks: Iterable[Track]) -> list[Batch]:
    """Return `tracks` stacked by the groups of `lazy_batches`."""
    return [each.whole for each in lazy_batches(tracks)]
