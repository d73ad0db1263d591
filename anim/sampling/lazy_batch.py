"""Tracks grouped by rule and time axis, with keys stacked when they are requested."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import compress

import numpy as np

from anim.arrays import Bools, Ints, group_indices
from anim.model import Interpolation, TimeAxis, Track
from anim.sampling.batch import Batch, MixedBatch, rule_of, stack_values

MAX_STACKED_KEYS = 1 << 18  # of the tracks of a batch; of a longer one only those requested are stacked, call by call
MAX_DIVIDED_VALUES = 1 << 18  # of tracks changed together: of long or wide ones few, for memory
MAX_MIXED_KEYS = 1 << 15  # of the tracks of an axis, of which a copy with those of other axes pays


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
        self._num_stacked = 0
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
            self._num_stacked += high - low
            keys = len(self.time_axis)
            if self._whole is not None or 2 * (high - low) >= keys or self._num_stacked > 2 * keys:
                return self.whole, left, right
        elif len(left) and high - low > 2 * len(left):
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

    def divide(self, keys: int = 0) -> Iterator[LazyBatch]:
        """Yield some of the tracks at a time: at most MAX_DIVIDED_VALUES values, of one track if it has more.

        keys: number of keys that become of each track, if they are more.
        """
        size = max(MAX_DIVIDED_VALUES // (max(len(self.time_axis), keys) * self.tracks[0].values.shape[1]), 1)
        for first in range(0, len(self.tracks), size):
            part = slice(first, first + size)
            yield LazyBatch(self.tracks[part], self.numbers[part])

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

    Of more than MAX_STACKED_KEYS keys, long axes are batches of their own, and several hold that many.
    """
    tracks = tuple(tracks)
    single: list[LazyBatch] = []
    mixed: list[MixedBatch] = []
    for group in group_indices(map(rule_of, tracks)).values():
        axes = [
            LazyBatch(each.tracks, np.array(group)[each.numbers]) for each in lazy_batches(tracks[i] for i in group)
        ]
        if sum(map(_num_keys, axes)) > MAX_STACKED_KEYS:
            single += [each for each in axes if _num_keys(each) > MAX_MIXED_KEYS]
            axes = [each for each in axes if _num_keys(each) <= MAX_MIXED_KEYS]
        for part in _parts(axes):
            if len(part) == 1:
                single += part
            else:
                mixed.append(_mix(part))
    return single, mixed


def _num_keys(batch: LazyBatch) -> int:
    return len(batch.time_axis) * len(batch.tracks)


def _parts(batches: list[LazyBatch]) -> list[list[LazyBatch]]:
    """Divide batches into lists of at most MAX_STACKED_KEYS keys."""
    parts, count = [list[LazyBatch]()], 0
    for each in batches:
        count += _num_keys(each)
        if parts[-1] and count > MAX_STACKED_KEYS:
            parts.append([])
            count = _num_keys(each)
        parts[-1].append(each)
    return parts if batches else []


def _mix(batches: list[LazyBatch]) -> MixedBatch:
    """Stack batches of different axes and one rule, in the order of their tracks."""
    numbers = np.concatenate([each.numbers for each in batches])
    order = np.argsort(numbers, kind="stable")
    tracks = [track for each in batches for track in each.tracks]
    chosen = tuple(tracks[i] for i in order.tolist())
    axis_of = np.repeat(np.arange(len(batches)), [len(each.tracks) for each in batches])[order]
    counts = np.array([len(track.values) for track in chosen])
    axes = tuple(each.time_axis for each in batches)
    joined = stack_values(chosen, np.concatenate)
    return MixedBatch(chosen, numbers[order], axes, axis_of, np.cumsum(counts) - counts, *joined)


def lazy_batches(tracks: Iterable[Track]) -> list[LazyBatch]:
    """Return `tracks` grouped by time axis and rule, in the order of their first members."""
    tracks = tuple(tracks)
    groups = group_indices((track.time_axis, rule_of(track)) for track in tracks)
    return [LazyBatch(tuple(tracks[i] for i in group), np.array(group)) for group in groups.values()]


def batches(tracks: Iterable[Track]) -> list[Batch]:
    """Return `tracks` stacked by the groups of `lazy_batches`."""
    return [each.whole for each in lazy_batches(tracks)]
