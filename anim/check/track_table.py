"""Keys of many tracks of one path in one array, for rules that look at all tracks of a file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.model import Track


class TrackTable(NamedTuple):
    """Keys (S, C) of T tracks with a node, one after the other. clips, nodes, starts, counts: (T,). times: (S,) s."""

    clips: Ints
    nodes: Ints
    starts: Ints
    counts: Ints
    values: Floats
    times: Floats

    def count_marked(self, marked: Bools) -> Ints:
        """Return the number of marked keys (S,) of each track (T,)."""
        return np.asarray(np.add.reduceat(marked, self.starts, dtype=np.int64)) if len(self.starts) else self.starts

    def range(self) -> tuple[Floats, Floats]:
        """Return the smallest and the largest value (T, C) of each track."""
        if not len(self.starts):
            return self.values, self.values
        return np.minimum.reduceat(self.values, self.starts), np.maximum.reduceat(self.values, self.starts)

    def inner_steps(self) -> Bools:
        """Return a mask (S,): False for the first key of a track, which has no step before it."""
        mask = np.ones(len(self.values), np.bool_)
        mask[self.starts] = False
        return mask

    def per_clip(self, counts: Ints) -> Iterator[tuple[int, int]]:
        """Yield the index of each clip with counts (T,) of its tracks above 0, and their sum."""
        sums = np.bincount(self.clips, counts)
        for clip in dict.fromkeys(self.clips[counts > 0].tolist()):
            yield clip, int(sums[clip])

    def first_keys(self, marked: Bools) -> dict[int, tuple[int, float]]:
        """Return node and time, s, of the earliest of the marked keys (S,) of each clip that has one, by its index."""
        keys = np.flatnonzero(marked)
        tracks = np.searchsorted(self.starts, keys, side="right") - 1
        order = np.lexsort((self.times[keys], self.clips[tracks]))
        clips = self.clips[tracks[order]]
        first = order[np.flatnonzero(np.diff(clips, prepend=-1))]
        found = zip(self.nodes[tracks[first]].tolist(), self.times[keys[first]].tolist(), strict=True)
        return dict(zip(self.clips[tracks[first]].tolist(), found, strict=True))

    def targets(self, marked: Bools) -> set[tuple[int, int]]:
        """Return clip and node of each marked track (T,)."""
        return {(int(self.clips[i]), int(self.nodes[i])) for i in np.flatnonzero(marked)}


def track_table(found: Sequence[tuple[int, Track]], path: str) -> TrackTable:
    """Return the table of tracks of a path, given with the indices of their clips.

    path: not "weights", whose width differs.
    """
    counts = np.array([len(track.values) for _, track in found], np.int64)
    values = [track.values for _, track in found]
    return TrackTable(
        np.array([clip for clip, _ in found], np.int64),
        np.array([track.node for _, track in found], np.int64),
        np.cumsum(counts) - counts,
        counts,
        np.concatenate(values) if values else np.zeros((0, 4 if path == "rotation" else 3)),
        np.concatenate([track.times for _, track in found]) if found else np.zeros(0),
    )
