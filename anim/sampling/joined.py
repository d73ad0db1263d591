"""Tracks of any clips laid end to end, so that numpy's cost per call is paid once for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Interpolation, Kind, Track
from anim.sampling.track import Located, interpolate

KEYS_AT_ONCE = 4096  # in one group: what is computed from them stays in the processor's cache


@dataclass(frozen=True, slots=True)
class Joined:
    """T tracks of one path, interpolation, kind and width, one after the other: S keys in all.

    numbers: (T,) which of the given tracks they are. counts: (T,) keys of each. starts: (T,) where each one begins.
    times: (S,) s. values: (S, C). tangents: in and out, both (S, C) per second, for CUBICSPLINE.
    """

    tracks: tuple[Track, ...]
    numbers: Ints
    counts: Ints
    starts: Ints
    times: Floats
    values: Floats
    tangents: tuple[Floats, Floats] | None

    @property
    def path(self) -> str:
        """The one path of all tracks."""
        return self.tracks[0].path

    @property
    def interpolation(self) -> Interpolation:
        """The one interpolation of all tracks."""
        return self.tracks[0].interpolation

    @property
    def kind(self) -> Kind:
        """The one kind of all tracks."""
        return self.tracks[0].kind

    def sample(self, at: Floats) -> Floats:
        """Return the values (T, F, C) of each track at times of its own: `at` (T, F) in seconds."""
        return interpolate(self._located(at), self.values, self.tangents, self.interpolation, self.kind)

    def _located(self, at: Floats) -> Located:
        """Where the times lie, as `sampling.track.locate` says: keys at or before each of them are counted."""
        before = self.times[:, None] <= np.repeat(at, self.counts, axis=0)
        last = self.counts[:, None] - 1
        in_track = np.clip(np.add.reduceat(before, self.starts, axis=0, dtype=np.int64) - 1, 0, last)
        left = self.starts[:, None] + in_track
        right = self.starts[:, None] + np.minimum(in_track + 1, last)
        duration = self.times[right] - self.times[left]
        inside = (at > self.times[left]) & (duration > 0)
        u = np.where(inside, (at - self.times[left]) / np.where(duration > 0, duration, 1.0), 0.0)
        return Located(left, right, u, duration)


def joined(tracks: Sequence[Track]) -> list[Joined]:
    """Return the tracks by path, interpolation, kind and width, each group laid end to end in their order.

    A group of over KEYS_AT_ONCE keys is split between its tracks.
    """
    groups: dict[tuple[str, Interpolation, Kind, int], list[list[int]]] = {}
    room: dict[tuple[str, Interpolation, Kind, int], int] = {}
    for i, track in enumerate(tracks):
        key = (track.path, track.interpolation, track.kind, track.values.shape[1])
        left = room.get(key, 0)
        if left <= 0:
            groups.setdefault(key, []).append([])
            left = KEYS_AT_ONCE
        groups[key][-1].append(i)
        room[key] = left - len(track.times)
    parts = [numbers for group in groups.values() for numbers in group]
    return [_laid(tuple(tracks[i] for i in numbers), np.array(numbers)) for numbers in parts]


def _laid(tracks: tuple[Track, ...], numbers: Ints) -> Joined:
    counts = np.array([len(track.times) for track in tracks])
    tangents = None
    if tracks[0].interpolation is Interpolation.CUBICSPLINE:
        arriving = [track.in_tangents for track in tracks if track.in_tangents is not None]
        leaving = [track.out_tangents for track in tracks if track.out_tangents is not None]
        tangents = np.concatenate(arriving), np.concatenate(leaving)
    return Joined(
        tracks,
        numbers,
        counts,
        np.cumsum(counts) - counts,
        np.concatenate([track.times for track in tracks]),
        np.concatenate([track.values for track in tracks]),
        tangents,
    )
