"""Tracks of any clips concatenated into one array, so that the cost per numpy call occurs once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Track
from anim.sampling.batch import Rule, Tangents, TrackGroup, rule, stack_values
from anim.sampling.track import KeyInterval, interpolate

MAX_GROUP_KEYS = 4096  # of one group: temporary arrays fit into the processor's cache


@dataclass(frozen=True, slots=True)
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

    def sample(self, at: Floats) -> Floats:
        """Return the values (T, F, C) of each track at times of its own: `at` (T, F) in seconds."""
        return interpolate(self._located(at), self.values, self.tangents, self.interpolation, self.kind)

    def _located(self, at: Floats) -> KeyInterval:
        """Key intervals of the times, as by `sampling.track.find_interval`, by counting keys at or before each time."""
        before = self.times[:, None] <= np.repeat(at, self.counts, axis=0)
        last = self.counts[:, None] - 1
        in_track = np.clip(np.add.reduceat(before, self.starts, axis=0, dtype=np.int64) - 1, 0, last)
        left = self.starts[:, None] + in_track
        right = self.starts[:, None] + np.minimum(in_track + 1, last)
        duration = self.times[right] - self.times[left]
        inside = (at > self.times[left]) & (duration > 0)
        u = np.where(inside, (at - self.times[left]) / np.where(duration > 0, duration, 1.0), 0.0)
        return KeyInterval(left, right, u, duration)


def concatenate(tracks: Sequence[Track]) -> list[ConcatenatedTracks]:
    """Return the tracks grouped by `alike.rule`, each group concatenated in their order.

    A group of over MAX_GROUP_KEYS keys is split between its tracks.
    """
    groups: dict[Rule, list[list[int]]] = {}
    room: dict[Rule, int] = {}
    for i, track in enumerate(tracks):
        key = rule(track)
        left = room.get(key, 0)
        if left <= 0:
            groups.setdefault(key, []).append([])
            left = MAX_GROUP_KEYS
        groups[key][-1].append(i)
        room[key] = left - len(track.times)
    parts = [numbers for group in groups.values() for numbers in group]
    return [_flatten_keys(tuple(tracks[i] for i in numbers), np.array(numbers)) for numbers in parts]


def _flatten_keys(tracks: tuple[Track, ...], numbers: Ints) -> ConcatenatedTracks:
    counts = np.array([len(track.times) for track in tracks])
    starts = np.cumsum(counts) - counts
    times = np.concatenate([track.times for track in tracks])
    return ConcatenatedTracks(tracks, numbers, counts, starts, times, *stack_values(tracks, np.concatenate))
