"""Many tracks sampled in one pass, each at times of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Track
from anim.sampling.track import KeyInterval, interpolate


class StackedTimes:
    """Key times of M tracks or curves, one after the other: S in all.

    times: (S,) s. counts, starts: (M,) number of keys of each, and index of its first one.
    """

    def __init__(self, times: Floats, counts: Ints) -> None:
        self.times, self.counts = times, counts
        self.starts: Ints = np.cumsum(counts) - counts
        self._pairs = _pair(np.repeat(np.arange(len(counts)), counts), times)

    def find(self, which: Ints, at: Floats, *, before: bool = False) -> tuple[Ints, Ints]:
        """Return the indices (F,) of the keys at or before times `at` (F,) of tracks `which` (F,), and the next ones.

        Both are clamped to the track's keys. before: keys before the times, none at them.
        """
        first, last = self.starts[which], self.starts[which] + self.counts[which] - 1
        place = np.searchsorted(self._pairs, _pair(which, at), side="left" if before else "right")
        left = np.clip(place - 1, first, last)
        return left, np.minimum(left + 1, last)


class TrackStack:
    """M tracks of one interpolation, kind and number of components, with their keys one after the other."""

    def __init__(self, tracks: Sequence[Track]) -> None:
        self.keys = StackedTimes(
            np.concatenate([track.times for track in tracks]), np.array([len(t.times) for t in tracks])
        )
        self.values = np.concatenate([track.values for track in tracks])
        self._interpolation, self._kind = tracks[0].interpolation, tracks[0].kind
        arriving = [track.in_tangents for track in tracks if track.in_tangents is not None]
        leaving = [track.out_tangents for track in tracks if track.out_tangents is not None]
        self._tangents = (np.concatenate(arriving), np.concatenate(leaving)) if arriving and leaving else None

    def sample(self, which: Ints, at: Floats) -> Floats:
        """Return the values (F, C) of tracks `which` (F,) at times `at` (F,) in seconds, as `track.sample` does."""
        return self.interpolate(*self.keys.find(which, at), at)

    def interpolate(self, left: Ints, right: Ints, at: Floats) -> Floats:
        """Return the values (F, C) at times `at` (F,) in seconds, between keys `left` and `right` (F,)."""
        times = self.keys.times
        duration = times[right] - times[left]
        inside = (at > times[left]) & (duration > 0)
        u = np.where(inside, (at - times[left]) / np.where(duration > 0, duration, 1.0), 0.0)
        place = KeyInterval(left, right, u, duration)
        return interpolate(place, self.values, self._tangents, self._interpolation, self._kind)


def _pair(which: Ints, at: Floats) -> np.ndarray[tuple[int, ...], np.dtype[np.complex128]]:
    """Indices and times as complex numbers, which numpy orders by index first: one search serves all tracks."""
    pairs = np.empty(len(at), np.complex128)
    pairs.real, pairs.imag = which, at
    return pairs
