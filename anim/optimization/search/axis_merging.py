"""Merging of time axes: tracks share the axes that together take the fewest bytes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, Ints, group_indices

MAX_STACKED_PAIRS = 1_000_000  # of groups of tracks whose axes are merged at once


@dataclass(frozen=True, slots=True)
class SharedAxis:
    """Mask (K,) of the grid's times that are the keys of all tracks `members`."""

    keys: Bools
    members: tuple[int, ...]

    @property
    def num_keys(self) -> int:
        """Number of the keys."""
        return int(np.count_nonzero(self.keys))


def merge_axes(
    asked: Sequence[tuple[Bools, Floats]], *, axis_bytes: float, time_bytes: float
) -> list[list[SharedAxis]]:
    """Return for each clip the axes of fewest bytes found for its tracks, which require the keys `keep` (G, K).

    asked: `keep`, and the bytes (G,) of one key of each track. An axis costs `axis_bytes` and `time_bytes` per key. The
    pair whose union saves most is merged until none saves anything.
    """
    merges = [_Groups(keep, key_bytes) for keep, key_bytes in asked]
    found: list[list[SharedAxis]] = []
    for some in _stackable(merges):
        found += _Merging(some, axis_bytes, time_bytes).run()
    return found


class _Groups:
    """The tracks of a clip in groups of equal keys. keys: (G', K). width: (G',) bytes of one key of a group."""

    def __init__(self, keep: Bools, key_bytes: Floats) -> None:
        self.members = list(group_indices(row.tobytes() for row in keep).values())
        self.keys = keep[[each[0] for each in self.members]]
        self.width = np.array([key_bytes[each].sum() for each in self.members])

    def __len__(self) -> int:
        return len(self.members)


def _stackable(merges: Sequence[_Groups]) -> Iterator[list[_Groups]]:
    """Parts of the list whose pairs of groups together fit in memory."""
    some: list[_Groups] = []
    for each in merges:
        if some and (len(some) + 1) * max(len(each), *map(len, some)) ** 2 > MAX_STACKED_PAIRS:
            yield some
            some = []
        some.append(each)
    if some:
        yield some


class _Merging:
    """Groups of tracks of B clips in padded arrays, with the bytes that merging each pair of them saves.

    sets: (B, G, K) 1 at the keys of each group. width: (B, G) bytes of one key of a group. gain: (B, G, G) bytes.
    """

    def __init__(self, clips: Sequence[_Groups], axis_bytes: float, time_bytes: float) -> None:
        self._clips, self._axis_bytes, self._time_bytes = clips, axis_bytes, time_bytes
        most, length = max(map(len, clips)), max(each.keys.shape[1] for each in clips)
        self._sets, self._width = np.zeros((len(clips), most, length)), np.zeros((len(clips), most))
        self._alive = np.zeros((len(clips), most), np.bool_)
        for n, each in enumerate(clips):
            self._sets[n, : len(each), : each.keys.shape[1]], self._width[n, : len(each)] = each.keys, each.width
            self._alive[n, : len(each)] = True
        self._count = self._sets.sum(axis=2)
        self._cost = axis_bytes + self._count * (time_bytes + self._width)
        self._gain = self._gain_of_all()

    def run(self) -> list[list[SharedAxis]]:
        """Return the axes of each clip; each step merges one pair in every clip that is not finished."""
        num_clips, most = self._width.shape
        flat = self._gain.reshape(num_clips, -1)
        while True:
            pair = flat.argmax(axis=1)
            some = np.flatnonzero(flat[np.arange(num_clips), pair] > 0)
            if not len(some):
                return [_axes(each, self._alive[n], self._sets[n] > 0) for n, each in enumerate(self._clips)]
            self._merge(some, *np.divmod(pair[some], most))

    def _gain_of_all(self) -> Floats:
        """(B, G, G) what merging each pair saves; −inf for a group with itself and for padding."""
        sets, width, count, cost = self._sets, self._width, self._count, self._cost
        union = count[:, :, None] + count[:, None] - sets @ sets.transpose(0, 2, 1)
        price = union * (self._time_bytes + width[:, :, None] + width[:, None])
        gain = np.asarray(cost[:, :, None] + cost[:, None] - self._axis_bytes - price)
        every = np.arange(width.shape[1])
        gain[:, every, every] = -np.inf
        gain[~(self._alive[:, :, None] & self._alive[:, None])] = -np.inf
        return gain

    def _merge(self, some: Ints, a: Ints, b: Ints) -> None:
        """Merge group `b` into group `a` (S,) of each of the clips `some` (S,)."""
        for n, i, j in zip(some.tolist(), a.tolist(), b.tolist(), strict=True):
            members = self._clips[n].members
            members[i] = members[i] + members[j]
        merged = np.maximum(self._sets[some, a], self._sets[some, b])
        self._sets[some, a] = merged
        self._width[some, a] += self._width[some, b]
        self._alive[some, b] = False
        self._count[some, a] = count = merged.sum(axis=1)
        self._cost[some, a] = self._axis_bytes + count * (self._time_bytes + self._width[some, a])
        self._gain[some, a] = self._gain[some, :, a] = self._gain_of(some, a)
        self._gain[some, b] = self._gain[some, :, b] = -np.inf

    def _gain_of(self, some: Ints, a: Ints) -> Floats:
        """(S, G) what merging group `a` (S,) of each of the clips `some` (S,) with each other group saves."""
        sets = self._sets if len(some) == len(self._sets) else self._sets[some]
        merged, count, width = self._sets[some, a], self._count[some, a], self._width[some, a]
        union = count[:, None] + self._count[some] - (sets @ merged[:, :, None])[..., 0]
        price = union * (self._time_bytes + width[:, None] + self._width[some])
        gain = np.asarray(self._cost[some, a][:, None] + self._cost[some] - self._axis_bytes - price)
        gain[~self._alive[some]] = -np.inf
        gain[np.arange(len(some)), a] = -np.inf
        return gain


def _axes(groups: _Groups, alive: Bools, keys: Bools) -> list[SharedAxis]:
    length = groups.keys.shape[1]
    return [
        SharedAxis(keys[n, :length].copy(), tuple(groups.members[n]))
        for n in np.flatnonzero(alive[: len(groups)]).tolist()
    ]
