"""Tracks on their time axes: keys fitted, as stored and as played, of all tracks of a trial at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

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
from anim.optimization.tracks.quantization import EncodedKeys

MAX_STACKED_VALUES = 1 << 18  # tracks × times at a time, each with about 300 bytes of temporary arrays


class KeyedAxes(NamedTuple):
    """The time axes of the trials of some clips. axis_of: (T,), the index of each track's axis, −1 for none."""

    axis_of: Ints
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
        return KeyedAxes(axis_of, intervals, KeyFit(intervals, clips.weights[clip_of]))

    def each(self, path: int, axes: KeyedAxes, tolerances: Floats) -> Iterator[StoredTracks]:
        """Yield all tracks of a path on axes, so many at a time as memory allows.

        path: index in PATHS. tolerances: (T,) for storage, in units of values.
        """
        clips = self._clips
        tracks = np.flatnonzero((axes.axis_of >= 0) & (clips.path == path))
        for some in (tracks[part] for part in self.parts(len(tracks))):
            yield self.store(some, clips.local[path][:, clips.row[some], clips.clip[some]], axes, tolerances)

    def parts(self, count: int) -> Iterator[slice]:
        """Yield parts of a number of tracks, as many at a time as memory allows."""
        step = max(MAX_STACKED_VALUES // self._clips.at.shape[1], 1)
        yield from (slice(first, first + step) for first in range(0, count, step))

    def store(self, tracks: Ints, values: Floats, axes: KeyedAxes, tolerances: Floats) -> StoredTracks:
        """Return tracks of one kind on axes, with other values (C, T, W) than their own.

        tolerances: of all tracks.
        """
        axis_of = axes.axis_of[tracks]
        keys = self._fit(tracks, values, axes)
        counts = axes.intervals.counts[axis_of]
        close_ends(keys, self._closures[tracks], counts)
        if (fixed := np.flatnonzero(self._is_part[tracks])).size:
            _fix_ends(keys, values, fixed, axes.intervals.at[axis_of[fixed]], counts[fixed])
        paths = [self._moving[i].path for i in tracks.tolist()]
        stored, keys = quantization.encode_stack(
            keys, counts.tolist(), paths, tolerances[tracks].tolist(), self._packing
        )
        play = playback.slerp_raw if len(values) == 4 else playback.lerp
        shown = play(keys, axes.intervals.left[axis_of], axes.intervals.u[axis_of])
        return StoredTracks(tracks, stored, keys, shown)

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


def _fix_ends(keys: Floats, values: Floats, tracks: Ints, at: Ints, counts: Ints) -> None:
    """Give the first and last keys of some tracks (t,) the values (C, T, W) there. at: (t, K). counts: (t,) keys."""
    last = counts - 1
    keys[:, tracks, 0] = values[:, tracks, at[:, 0]]
    keys[:, tracks, last] = values[:, tracks, at[np.arange(len(at)), last]]
