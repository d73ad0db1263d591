"""Tracks on their time axes: keys fitted, as stored and as played, of all tracks of a trial at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from anim.arrays import Floats, Ints
from anim.optimization.options import Packing
from anim.optimization.search import playback
from anim.optimization.search.axis_merging import SharedAxis
from anim.optimization.search.key_fit import KeyFit
from anim.optimization.search.key_intervals import KeyIntervals, find_intervals
from anim.optimization.search.stacked_clips import StackedClips
from anim.optimization.tracks import quantization
from anim.optimization.tracks.clip_ends import close_ends
from anim.optimization.tracks.quantization import EncodedKeys, storage_level

MAX_STACKED_VALUES = 1 << 18  # tracks × times at a time, each with about 300 bytes of temporary arrays


MAX_KNOWN_VALUES = 1_000_000  # of keys of earlier trials: 8 MB; a larger cache is cleared
NO_KEYS = EncodedKeys(np.empty((0, 0)), "float32")

_Name: TypeAlias = tuple[int, bytes, int]  # track, time axis and storage level


class KeyedAxes(NamedTuple):
    """The time axes of the trials of some clips.

    axis_of: (T,), the index of each track's axis, −1 for none. names: of each axis, equal for equal axes of one clip.
    """

    axis_of: Ints
    names: list[bytes]
    intervals: KeyIntervals
    fit: KeyFit


class StoredTracks(NamedTuple):
    """Tracks of one kind, rotations or vectors, with their stored keys.

    tracks: (T,), indices. stored: per track. keys: (C, T, K), the stored values; after a track's last key any.
    shown: (C, T, W), played values at the measurement times.
    """

    tracks: Ints
    stored: list[EncodedKeys]
    keys: Floats
    shown: Floats


class KeyedTracks:
    """Makes the keys of several clips' tracks."""

    def __init__(self, clips: StackedClips, packing: Packing) -> None:
        self._clips = clips
        self._packing = packing
        self._moving = [each for source in clips.sources for each in source.moving]
        self._closures = np.array([each.closure for each in self._moving])
        self._paths = [each.path for each in self._moving]
        self._known: dict[_Name, EncodedKeys] = {}
        self._num_known_values = 0
        self._is_part = np.array([source.is_part for source in clips.sources])[clips.clip]
        self._grid_sizes = np.array([len(source.grid) for source in clips.sources])[clips.clip]

    def on(self, axes: Sequence[tuple[int, Sequence[SharedAxis]]]) -> KeyedAxes:
        """Return the axes of some clips, each given with its index, and what all tracks on them share."""
        clips = self._clips
        axis_of = np.full(len(self._moving), -1)
        listed = [(clip, axis) for clip, some in axes for axis in some]
        keys = np.zeros((len(listed), clips.grid.shape[1]), np.bool_)
        for number, (clip, axis) in enumerate(listed):
            axis_of[clips.first_track[clip] + np.array(axis.members)] = number
            keys[number, : len(axis.keys)] = axis.keys
        clip_of = np.array([clip for clip, _ in listed], np.int64)
        intervals = find_intervals(keys, clips, clip_of)
        names = [axis.keys.tobytes() for _, axis in listed]
        return KeyedAxes(axis_of, names, intervals, KeyFit(intervals, clips.weights[clip_of]))

    def each(self, path: int, axes: KeyedAxes, tolerances: Floats) -> Iterator[StoredTracks]:
        """Yield all tracks of a path on axes, so many at a time as memory allows.

        path: index in PATHS. tolerances: (T,) for storage, in units of values.
        """
        clips = self._clips
        tracks = np.flatnonzero((axes.axis_of >= 0) & (clips.path == path))
        for some in (tracks[part] for part in self.parts(len(tracks))):
            yield self._store_own(some, clips.local[path][:, clips.row[some], clips.clip[some]], axes, tolerances)

    def parts(self, count: int) -> Iterator[slice]:
        """Yield parts of a number of tracks, as many at a time as memory allows."""
        step = max(MAX_STACKED_VALUES // self._clips.at.shape[1], 1)
        yield from (slice(first, first + step) for first in range(0, count, step))

    def store(self, tracks: Ints, values: Floats, axes: KeyedAxes, tolerances: Floats) -> StoredTracks:
        """Return tracks of one kind on axes, with other values (C, T, W) than their own.

        tolerances: of all tracks.
        """
        stored, keys = self._make(tracks, values, axes, tolerances)
        return StoredTracks(tracks, stored, keys, _play(keys, axes, tracks))

    def _store_own(self, tracks: Ints, values: Floats, axes: KeyedAxes, tolerances: Floats) -> StoredTracks:
        """The same with their own values: in most trials most tracks have the axis and format of an earlier one."""
        names = self._names(tracks, axes, tolerances)
        missing = np.array([name not in self._known for name in names], np.bool_)
        if missing.all():
            stored, keys = self._make(tracks, values, axes, tolerances)
            self._keep(names, stored)
            return StoredTracks(tracks, stored, keys, _play(keys, axes, tracks))
        stored = [self._known.get(name, NO_KEYS) for name in names]
        if missing.any():
            some = np.flatnonzero(missing)
            made, _ = self._make(tracks[some], values[:, some], axes, tolerances)
            for n, each in zip(some.tolist(), made, strict=True):
                stored[n] = each
            self._keep([names[n] for n in some.tolist()], made)
        keys = _stack_keys(stored, axes.intervals.at.shape[1])
        return StoredTracks(tracks, stored, keys, _play(keys, axes, tracks))

    def _names(self, tracks: Ints, axes: KeyedAxes, tolerances: Floats) -> list[_Name]:
        """Of each track a value that is equal for equal keys."""
        axis_of, listed = axes.axis_of[tracks].tolist(), tolerances[tracks].tolist()
        return [
            (track, axes.names[axis], storage_level(self._paths[track], tolerance, self._packing))
            for track, axis, tolerance in zip(tracks.tolist(), axis_of, listed, strict=True)
        ]

    def _keep(self, names: Sequence[_Name], stored: Sequence[EncodedKeys]) -> None:
        """Keep keys for further trials."""
        self._num_known_values += sum(each.values.size for each in stored)
        if self._num_known_values > MAX_KNOWN_VALUES:
            self._known.clear()
            self._num_known_values = 0
        self._known.update(zip(names, stored, strict=True))

    def _make(
        self, tracks: Ints, values: Floats, axes: KeyedAxes, tolerances: Floats
    ) -> tuple[list[EncodedKeys], Floats]:
        """The stored keys of tracks, and their values (C, T, K)."""
        axis_of = axes.axis_of[tracks]
        keys = self._fit(tracks, values, axes)
        counts = axes.intervals.counts[axis_of]
        close_ends(keys, self._closures[tracks], counts)
        if (fixed := np.flatnonzero(self._is_part[tracks])).size:
            _fix_ends(keys, values, fixed, axes.intervals.at[axis_of[fixed]], counts[fixed])
        paths = [self._paths[i] for i in tracks.tolist()]
        return quantization.encode_stack(keys, counts.tolist(), paths, tolerances[tracks].tolist(), self._packing)

    def _fit(self, tracks: Ints, values: Floats, axes: KeyedAxes) -> Floats:
        """Keys (C, T, K) of values (C, T, W): on an axis with every key their own, else a fit."""
        axis_of = axes.axis_of[tracks]
        at = axes.intervals.at[axis_of]
        flat = at + values.shape[2] * np.arange(len(at))[:, None]
        keys: Floats = np.take(values.reshape(len(values), -1), flat, axis=1)
        is_full = axes.intervals.counts[axis_of] == self._grid_sizes[tracks]
        if is_full.all():
            return keys
        if len(values) == 4:
            fitted = axes.fit.rotations(values, keys, axis_of)
        else:
            fitted = axes.fit.vectors(values, axis_of)
        fitted[:, is_full] = keys[:, is_full]
        return fitted


def _stack_keys(stored: Sequence[EncodedKeys], length: int) -> Floats:
    """The values (C, T, `length`) of the keys of each track, the last one repeated."""
    counts = np.array([len(each.values) for each in stored])
    index = (np.cumsum(counts) - counts)[:, None] + np.minimum(np.arange(length), counts[:, None] - 1)
    values = np.ascontiguousarray(np.concatenate([each.values for each in stored]).T)
    return np.asarray(np.take(values, index, axis=1))


def _play(keys: Floats, axes: KeyedAxes, tracks: Ints) -> Floats:
    """The values (C, T, W) of tracks with keys (C, T, K) at the measurement times."""
    axis_of = axes.axis_of[tracks]
    play = playback.slerp_raw if len(keys) == 4 else playback.lerp
    return play(keys, axes.intervals.left[axis_of], axes.intervals.u[axis_of])


def _fix_ends(keys: Floats, values: Floats, tracks: Ints, at: Ints, counts: Ints) -> None:
    """Give the first and last keys of some tracks (t,) the values (C, T, W) there. at: (t, K). counts: (t,) keys."""
    last = counts - 1
    keys[:, tracks, 0] = values[:, tracks, at[:, 0]]
    keys[:, tracks, last] = values[:, tracks, at[np.arange(len(at)), last]]
