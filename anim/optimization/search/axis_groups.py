"""Groups of tracks that share a time axis, chosen by the keys that the tracks of a group require together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats, Ints

MAX_SMALL_VALUES = 3000  # keys of all rows up to which numbers of keys are counted in log2(K) steps
STEPS_AT_ONCE = 4  # from key to key, before it is asked whether all rows have ended; further ones change nothing
MAX_STACKED_VALUES = 1_000_000  # pairs of groups × keys of the clips whose tracks are grouped at once

Reaches: TypeAlias = tuple[Ints, Floats]
"""For each of K keys of k tracks the last one that a segment reaches (k, K), and bytes of one key of each (k,)."""


def group_tracks(asked: Sequence[Reaches], *, axis_bytes: float, time_bytes: float) -> list[list[Ints]]:
    """Return for each clip the groups of its tracks whose axes together take the fewest bytes found.

    An axis costs `axis_bytes` and `time_bytes` per key. Of all pairs of groups the one is merged that saves most, until
    none saves anything.
    """
    found: list[list[Ints]] = []
    for some in _stackable(asked):
        found += _Grouping(some, axis_bytes, time_bytes).run()
    return found


def num_keys(reach: Ints, last: Ints) -> Ints:
    """Return the number of keys (...) that reach from the first to the `last` (...) one, of rows (..., K).

    ([[1 3 3 3]], [3]) → [3]: keys 0, 1 and 3
    """
    first = np.arange(0, reach.size, reach.shape[-1])
    end = np.broadcast_to(last, reach.shape[:-1]).reshape(-1)
    count_keys = _count_by_doubling if reach.size <= MAX_SMALL_VALUES else _count_by_steps
    return count_keys(reach.reshape(-1), first, end).reshape(reach.shape[:-1])


def _count_by_steps(reach: Ints, first: Ints, end: Ints) -> Ints:
    """The numbers of keys of rows that start at `first`, from key to key."""
    ahead = (reach.reshape(len(first), -1) + first[:, None]).reshape(-1)
    at, last, count = first, first + end, np.ones_like(first)
    while (going := at < last).any():
        for _ in range(STEPS_AT_ONCE):
            count += going
            at = ahead[at]
            going = at < last
    return count


def _count_by_doubling(reach: Ints, first: Ints, end: Ints) -> Ints:
    """The same in log2(K) steps, each of twice as many keys from every key: fewer calls for few rows."""
    length = len(reach) // max(len(first), 1)
    ahead = (np.minimum(reach.reshape(len(first), length), end[:, None]) + first[:, None]).reshape(-1)
    passed = (ahead > np.arange(len(ahead))).astype(np.int64)
    for _ in range((length - 1).bit_length()):
        passed += passed[ahead]
        ahead = ahead[ahead]
    return 1 + passed[first]


def _stackable(asked: Sequence[Reaches]) -> Iterator[list[Reaches]]:
    """Parts of the list whose pairs of tracks together fit in memory."""
    some: list[Reaches] = []
    for each in asked:
        tracks, length = np.max([reach.shape for reach, _ in (*some, each)], axis=0).tolist()
        if some and (len(some) + 1) * tracks**2 * length > MAX_STACKED_VALUES:
            yield some
            some = []
        some.append(each)
    if some:
        yield some


class _Grouping:
    """Groups of tracks of B clips in padded arrays, with the bytes that merging each pair of them saves.

    reach: (B, G, K) of all tracks of each group together. last: (B,) key of each clip. width: (B, G) bytes of one key
    of a group. cost: (B, G) bytes. gain: (B, G, G) bytes.
    """

    def __init__(self, clips: Sequence[Reaches], axis_bytes: float, time_bytes: float) -> None:
        self._axis_bytes, self._time_bytes = axis_bytes, time_bytes
        self._members = [[[i] for i in range(len(reach))] for reach, _ in clips]
        self._last = np.array([reach.shape[1] - 1 for reach, _ in clips])
        most, length = max(map(len, self._members)), int(self._last.max()) + 1
        self._reach = np.broadcast_to(self._last[:, None, None], (len(clips), most, length)).copy()
        self._width, self._alive = np.zeros((len(clips), most)), np.zeros((len(clips), most), np.bool_)
        for n, (reach, width) in enumerate(clips):
            self._reach[n, : len(reach), : reach.shape[1]], self._width[n, : len(reach)] = reach, width
            self._alive[n, : len(reach)] = True
        self._cost = self._price(num_keys(self._reach, self._last[:, None]), self._width)
        self._gain = self._gain_of_all()

    def run(self) -> list[list[Ints]]:
        """Return the groups of each clip; each step merges one pair in every clip that is not finished."""
        num_clips, most = self._width.shape
        flat = self._gain.reshape(num_clips, -1)
        while True:
            pair = flat.argmax(axis=1)
            some = np.flatnonzero(flat[np.arange(num_clips), pair] > 0)
            if not len(some):
                alive = [np.flatnonzero(each).tolist() for each in self._alive]
                return [[np.array(self._members[n][i]) for i in each] for n, each in enumerate(alive)]
            self._merge(some, *np.divmod(pair[some], most))

    def _price(self, count: Ints, width: Floats) -> Floats:
        return np.asarray(self._axis_bytes + count * (self._time_bytes + width))

    def _gain_of_all(self) -> Floats:
        """(B, G, G) what merging each pair saves; −inf for a group with itself and for padding."""
        reach, width, cost, alive = self._reach, self._width, self._cost, self._alive
        counts = num_keys(np.minimum(reach[:, :, None], reach[:, None]), self._last[:, None, None])
        price = self._price(counts, width[:, :, None] + width[:, None])
        gain = np.asarray(cost[:, :, None] + cost[:, None] - price)
        every = np.arange(width.shape[1])
        gain[:, every, every] = -np.inf
        gain[~(alive[:, :, None] & alive[:, None])] = -np.inf
        return gain

    def _merge(self, some: Ints, a: Ints, b: Ints) -> None:
        """Merge group `b` into group `a` (S,) of each of the clips `some` (S,)."""
        for n, i, j in zip(some.tolist(), a.tolist(), b.tolist(), strict=True):
            self._members[n][i] += self._members[n][j]
        self._reach[some, a] = np.minimum(self._reach[some, a], self._reach[some, b])
        self._width[some, a] += self._width[some, b]
        self._cost[some, a] += self._cost[some, b] - self._gain[some, a, b]
        self._alive[some, b] = False
        self._gain[some, a] = self._gain[some, :, a] = self._gain_of(some, a)
        self._gain[some, b] = self._gain[some, :, b] = -np.inf

    def _gain_of(self, some: Ints, a: Ints) -> Floats:
        """(S, G) what merging group `a` (S,) of each of the clips `some` (S,) with each other group saves."""
        clip, group = np.nonzero(self._alive[some])
        mine = a[clip]
        clip = some[clip]
        counts = num_keys(np.minimum(self._reach[clip, group], self._reach[clip, mine]), self._last[clip])
        price = self._price(counts, self._width[clip, group] + self._width[clip, mine])
        gain = np.full((len(some), self._width.shape[1]), -np.inf)
        gain[self._alive[some]] = self._cost[clip, group] + self._cost[clip, mine] - price
        gain[np.arange(len(some)), a] = -np.inf
        return gain
