"""Keys of many tracks of one path in one array, for rules that look at all tracks of a file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Identity, Ints
from anim.model import Track

MAX_BLOCK_KEYS = 1 << 17  # of the tracks of a table, unless one has more: temporary arrays stay small


class TrackTable(NamedTuple):
    """Keys of T tracks with a node, S in all: R runs, one after the other.

    Tracks that share their keys have one run, if there are many keys.
    clips, nodes, runs: (T,), with the index of each track's run. starts, counts: (R,) of keys.
    values: (S, C). times: (S,) s.
    """

    clips: Ints
    nodes: Ints
    runs: Ints
    starts: Ints
    counts: Ints
    values: Floats
    times: Floats

    def count_marked(self, marked: Bools) -> Ints:
        """Return the number of marked keys (S,) of each track (T,)."""
        if not len(self.starts):
            return self.starts
        return np.asarray(np.add.reduceat(marked, self.starts, dtype=np.int64)[self.runs])

    def range(self) -> tuple[Floats, Floats]:
        """Return the smallest and the largest value (T, C) of each track."""
        if not len(self.starts):
            return self.values, self.values
        least, most = (extreme.reduceat(self.values, self.starts) for extreme in (np.minimum, np.maximum))
        return least[self.runs], most[self.runs]

    def inner_steps(self) -> Bools:
        """Return a mask (S,): False for the first key of a track, which has no step before it."""
        mask = np.ones(len(self.values), np.bool_)
        mask[self.starts] = False
        return mask

    def first_keys(self, marked: Bools) -> dict[int, tuple[int, float]]:
        """Return node and time, s, of the earliest of the marked keys (S,) of each clip that has one, by its index."""
        keys = np.flatnonzero(marked)
        runs = np.searchsorted(self.starts, keys, side="right") - 1
        first = np.flatnonzero(np.diff(runs, prepend=-1))
        times = np.full(len(self.starts), np.inf)
        times[runs[first]] = self.times[keys[first]]
        found: dict[int, tuple[int, float]] = {}
        tracks = np.flatnonzero(np.isfinite(times[self.runs]))
        order = tracks[np.argsort(times[self.runs[tracks]], kind="stable")]
        for clip, i in zip(self.clips[order].tolist(), order.tolist(), strict=True):
            found.setdefault(clip, (int(self.nodes[i]), float(times[self.runs[i]])))
        return found

    def targets(self, marked: Bools) -> set[tuple[int, int]]:
        """Return clip and node of each marked track (T,)."""
        return {(int(self.clips[i]), int(self.nodes[i])) for i in np.flatnonzero(marked)}


def add_counts(sums: dict[int, int], table: TrackTable, counts: Ints) -> None:
    """Add the counts (T,) of a table's tracks to the sums by clip, in place; those of 0 add no clip."""
    each = np.bincount(table.clips, counts)
    for clip in dict.fromkeys(table.clips[counts > 0].tolist()):
        sums[clip] = sums.get(clip, 0) + int(each[clip])


def keep_earliest(first: dict[int, tuple[int, float]], table: TrackTable, marked: Bools) -> None:
    """Replace, in place, the first key of each clip by a marked one (S,) of the table that is earlier.

    first: node and time, s, by clip.
    """
    for clip, key in table.first_keys(marked).items():
        if clip not in first or key[1] < first[clip][1]:
            first[clip] = key


def track_tables(found: Sequence[tuple[int, Track]], path: str) -> Iterator[TrackTable]:
    """Yield tables of tracks of a path, given with the indices of their clips, in their order.

    path: not "weights", whose width differs.
    """
    if found and _num_keys(found) <= MAX_BLOCK_KEYS:
        yield track_table(found, path)
        return
    block: list[tuple[int, Track]] = []
    seen: set[Identity] = set()
    size = 0
    for each in found:
        keys = _identity(each[1])
        if keys not in seen:
            if size and size + len(each[1].values) > MAX_BLOCK_KEYS:
                yield track_table(block, path)
                block, seen, size = [], set(), 0
            seen.add(keys)
            size += len(each[1].values)
        block.append(each)
    if block:
        yield track_table(block, path)


def track_table(found: Sequence[tuple[int, Track]], path: str) -> TrackTable:
    """Return one table of all tracks, otherwise as `track_tables`."""
    if _num_keys(found) <= MAX_BLOCK_KEYS:  # to know which tracks share keys takes longer than to look at all
        chosen, numbers = [track for _, track in found], list(range(len(found)))
    else:
        chosen, numbers = _distinct_runs(found)
    counts = np.array([len(track.values) for track in chosen], np.int64)
    return TrackTable(
        np.array([clip for clip, _ in found], np.int64),
        np.array([track.node for _, track in found], np.int64),
        np.array(numbers, np.int64),
        np.cumsum(counts) - counts,
        counts,
        np.concatenate([track.values for track in chosen]) if chosen else np.zeros((0, 4 if path == "rotation" else 3)),
        np.concatenate([track.times for track in chosen]) if chosen else np.zeros(0),
    )


def _num_keys(found: Sequence[tuple[int, Track]]) -> int:
    return sum(len(track.values) for _, track in found)


def _distinct_runs(found: Sequence[tuple[int, Track]]) -> tuple[list[Track], list[int]]:
    """One track of each that share their keys, and for every track the index of that one."""
    runs: dict[Identity, int] = {}
    chosen: list[Track] = []
    numbers = []
    for _, track in found:
        number = runs.setdefault(_identity(track), len(chosen))
        if number == len(chosen):
            chosen.append(track)
        numbers.append(number)
    return chosen, numbers


def _identity(track: Track) -> Identity:
    """The same for tracks that share their keys, as those of one pair of accessors do."""
    return Identity(track.values, track.times)
