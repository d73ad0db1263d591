"""Tracks in one array, stacked per time axis or concatenated: the cost per numpy call occurs once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import TypeAlias

import numpy as np

from anim.arrays import Bools, Floats, Ints, group_indices
from anim.model import Interpolation, TimeAxis, Track, ValueKind
from anim.sampling.track import KeyInterval, find_interval, interpolate

MAX_GROUP_KEYS = 4096  # of concatenated tracks: temporary arrays fit into the processor's cache
MAX_COMPARED_PER_TRACK = 2000  # keys × times; comparing more takes longer than a search in each track

Rule: TypeAlias = tuple[str, Interpolation, ValueKind, int]
Tangents: TypeAlias = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class TrackGroup:
    """T tracks of one path, interpolation, value type and number of components: a rule.

    numbers: (T,) indices among those given.
    """

    tracks: tuple[Track, ...]
    numbers: Ints

    @property
    def path(self) -> str:
        """Path of all tracks."""
        return self.tracks[0].path

    @property
    def interpolation(self) -> Interpolation:
        """Interpolation of all tracks."""
        return self.tracks[0].interpolation

    @property
    def kind(self) -> ValueKind:
        """Value type of all tracks."""
        return self.tracks[0].kind


@dataclass(frozen=True, slots=True, eq=False)
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

    def is_inside(self, at: Floats) -> Bools:
        """Return the mask (F,) of the times from the first key on and before the last."""
        return np.asarray((at >= self.times[0]) & (at < self.times[-1]))

    def sample(self, at: Floats, place: KeyInterval | None = None) -> Floats:
        """Return the values (F, G, C) at times `at` (F,); a known `place` saves its search."""
        place = place or find_interval(self.times, at)
        return interpolate(place, self.values, self.tangents, self.interpolation, self.kind)

    def take(self, keys: slice | Ints, time_axis: TimeAxis) -> Batch:
        """Return some of the keys, with their times."""
        tangents = self.tangents and (self.tangents[0][keys], self.tangents[1][keys])
        return Batch(self.tracks, self.numbers, time_axis, self.values[keys], tangents)

    def pick(self, chosen: Bools) -> Batch:
        """Return the chosen (G,) of the tracks."""
        tangents = self.tangents and (self.tangents[0][:, chosen], self.tangents[1][:, chosen])
        tracks = tuple(compress(self.tracks, chosen.tolist()))
        return Batch(tracks, self.numbers[chosen], self.time_axis, self.values[:, chosen], tangents)


@dataclass(frozen=True, slots=True, eq=False)
class MixedBatch(TrackGroup):
    """G tracks of one rule with different times, keys concatenated: S keys in all.

    axes: distinct. axis_of: (G,) index of each track's axis. starts: (G,) offset of each track's first key.
    values: (S, C). tangents: in and out, both (S, C) per second, for CUBICSPLINE.
    """

    axes: tuple[TimeAxis, ...]
    axis_of: Ints
    starts: Ints
    values: Floats
    tangents: Tangents | None

    def find_intervals(self, places: Mapping[TimeAxis, KeyInterval]) -> KeyInterval:
        """Return the key intervals (F, G) of all tracks, from those of the axes at F times."""
        found = [places[axis] for axis in self.axes]
        left, right, u, duration = (np.stack(parts, axis=1)[:, self.axis_of] for parts in zip(*found, strict=True))
        return KeyInterval(left + self.starts, right + self.starts, u, duration)

    def is_inside(self, at: Floats) -> Bools:
        """Return the mask (F, G) of the times from each track's first key on and before its last."""
        first, last = (np.array([axis.times[k] for axis in self.axes]) for k in (0, -1))
        inside = (at[:, None] >= first) & (at[:, None] < last)
        return np.asarray(inside[:, self.axis_of])

    def sample(self, at: Floats, place: KeyInterval) -> Floats:
        """Return the values (F, G, C) at times `at` (F,). place: of `find_intervals`."""
        del at
        return interpolate(place, self.values, self.tangents, self.interpolation, self.kind)


@dataclass(frozen=True, slots=True, eq=False)
class ConcatenatedTracks(TrackGroup):
    """T tracks of one rule, concatenated: S keys in all.

    counts: (T,) keys of each. starts: (T,) offset of each one's first key.
    times: (S,) s. values: (S, C). tangents: in and out, both (S, C) per second, for CUBICSPLINE.
    """

    counts: Ints
    starts: Ints
    times: Floats
    values: Floats
    tangents: Tangents | None

    def sample(self, at: Floats, place: KeyInterval | None = None) -> Floats:
        """Return the values (T, F, C) of each track at times of its own: `at` (T, F) in seconds.

        place: of `find_intervals` or `intervals_of_rows`, if known.
        """
        place = place or self.find_intervals(at)
        return interpolate(place, self.values, self.tangents, self.interpolation, self.kind)

    def is_inside(self, at: Floats) -> Bools:
        """Return the mask (T, F) of the times (T, F) from each track's first key on and before its last."""
        first, last = self.times[self.starts], self.times[self.starts + self.counts - 1]
        return np.asarray((at >= first[:, None]) & (at < last[:, None]))

    def intervals_of_rows(self, at: Floats, rows: Ints) -> KeyInterval:
        """Return the key intervals (T, F) of times in `rows` (T,) of `at` (B, F) s.

        They are found once per time axis and row.
        """
        pairs: dict[tuple[TimeAxis, int], int] = {}
        axes = [track.time_axis for track in self.tracks]
        number = np.array([pairs.setdefault(pair, len(pairs)) for pair in zip(axes, rows.tolist(), strict=True)])
        if 2 * len(pairs) > len(self.tracks):
            return self.find_intervals(at[rows])
        times, of_pair = [axis.times for axis, _ in pairs], [row for _, row in pairs]
        counts = np.array([len(each) for each in times])
        starts = np.cumsum(counts) - counts
        found = _find_intervals(np.concatenate(times), starts, counts, at[of_pair])
        left, right, u, duration = (part[number] for part in found)
        moved = (self.starts - starts[number])[:, None]
        return KeyInterval(left + moved, right + moved, u, duration)

    def find_intervals(self, at: Floats) -> KeyInterval:
        """Return the key intervals (T, F) of the times `at` (T, F) s, as by `find_interval`."""
        return _find_intervals(self.times, self.starts, self.counts, at)


def _find_intervals(times: Floats, starts: Ints, counts: Ints, at: Floats) -> KeyInterval:
    """The key intervals (A, F) of times `at` (A, F) s in A axes, concatenated as `times`."""
    last = counts[:, None] - 1
    in_axis = np.clip(_count_keys(times, starts, counts, at) - 1, 0, last)
    left = starts[:, None] + in_axis
    right = starts[:, None] + np.minimum(in_axis + 1, last)
    duration = times[right] - times[left]
    inside = (at > times[left]) & (duration > 0)
    u = np.where(inside, (at - times[left]) / np.where(duration > 0, duration, 1.0), 0.0)
    return KeyInterval(left, right, u, duration)


def _count_keys(times: Floats, starts: Ints, counts: Ints, at: Floats) -> Ints:
    """Number of keys (A, F) of each of the axes at or before its times `at` (A, F)."""
    if len(times) * at.shape[1] > MAX_COMPARED_PER_TRACK * len(counts):
        axes = np.split(times, starts[1:])
        return np.array([axis.searchsorted(each, "right") for axis, each in zip(axes, at, strict=True)], np.int64)
    before = times[:, None] <= np.repeat(at, counts, axis=0)
    return np.asarray(np.add.reduceat(before, starts, axis=0, dtype=np.int64))


def concatenate(tracks: Sequence[Track]) -> list[ConcatenatedTracks]:
    """Return the tracks grouped by rule, each group concatenated in their order.

    A group of over MAX_GROUP_KEYS keys is split between its tracks.
    """
    return list(iterate_concatenated(tracks))


def iterate_concatenated(tracks: Sequence[Track]) -> Iterator[ConcatenatedTracks]:
    """Yield the groups of `concatenate`, so that keys of one need to be in memory twice at a time."""
    for numbers in group_indices(map(rule_of, tracks)).values():
        counts = [len(tracks[i].values) for i in numbers]
        for part in _parts(counts):
            some = numbers[part]
            yield _flatten_keys(tuple([tracks[i] for i in some]), np.array(some), np.array(counts[part]))


def _parts(counts: Sequence[int]) -> Iterator[slice]:
    """Yield the parts of a group with these numbers of keys: each ends with the track that fills it."""
    first, size = 0, 0
    for end, count in enumerate(counts, 1):
        size += count
        if size >= MAX_GROUP_KEYS or end == len(counts):
            yield slice(first, end)
            first, size = end, 0


def _flatten_keys(tracks: tuple[Track, ...], numbers: Ints, counts: Ints) -> ConcatenatedTracks:
    starts = np.cumsum(counts) - counts
    times = _join([track.time_axis.times for track in tracks])
    return ConcatenatedTracks(tracks, numbers, counts, starts, times, *stack_values(tracks, _join))


def _join(parts: Sequence[Floats]) -> Floats:
    """One array of several; that of a long track alone is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def rule_of(track: Track) -> Rule:
    """Return what tracks of one batch have in common."""
    return track.path, track.interpolation, track.kind, track.values.shape[1]


def stack_values(tracks: Sequence[Track], join: Callable[[Sequence[Floats]], Floats]) -> tuple[Floats, Tangents | None]:
    """Return the values of tracks of one rule, and their in and out tangents, None without CUBICSPLINE.

    join: makes one array of each track's (K, C).
    """
    values = join([track.values for track in tracks])
    if tracks[0].interpolation is not Interpolation.CUBICSPLINE:
        return values, None
    arriving = [track.in_tangents for track in tracks if track.in_tangents is not None]
    leaving = [track.out_tangents for track in tracks if track.out_tangents is not None]
    return values, (join(arriving), join(leaving))
