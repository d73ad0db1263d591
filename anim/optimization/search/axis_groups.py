"""Groups of tracks that share a time axis, chosen by the keys that the tracks of a group require together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints


class AxisCosts(NamedTuple):
    """Bytes of a time axis: of the axis itself, of each key's time, and (k,) of each key's value in each track."""

    axis: float
    time: float
    values: Floats


def group_tracks(reach: Ints, costs: AxisCosts) -> list[Ints]:
    """Return the groups of the k tracks whose axes together take the fewest bytes found.

    reach: (k, K), for each key of a track the last one that a segment reaches. Of all pairs of groups the one is merged
    that saves most, until none saves anything.
    """
    return _Grouping(reach, costs).run()


def num_keys(reach: Ints) -> Ints:
    """Return the number of keys (...) that reach from the first to the last one, of rows (..., K) as of `group_tracks`.

    ([[1 3 3 3]]) → [3]: keys 0, 1 and 3
    """
    length = reach.shape[-1]
    flat, first = reach.reshape(-1), np.arange(0, reach.size, length)
    at, count = np.zeros(len(first), np.int64), np.ones(len(first), np.int64)
    while (going := at < length - 1).any():
        at = flat[first + at]
        count += going
    return count.reshape(reach.shape[:-1])


class _Grouping:
    """Groups in arrays: reach (k, K) of all tracks of each group together, width (k,) bytes of a key, cost (k,) bytes.

    gain: (k, k) bytes that merging each pair saves.
    """

    def __init__(self, reach: Ints, costs: AxisCosts) -> None:
        self._axis, self._time = costs.axis, costs.time
        self._members = [[i] for i in range(len(reach))]
        self._reach, self._width = reach.copy(), costs.values.copy()
        self._alive = np.ones(len(reach), np.bool_)
        self._cost = self._price(num_keys(reach), self._width)
        pairs = np.minimum(reach[:, None], reach)
        price = self._price(num_keys(pairs), self._width[:, None] + self._width)
        self._gain = self._cost[:, None] + self._cost - price
        np.fill_diagonal(self._gain, -np.inf)

    def run(self) -> list[Ints]:
        while True:
            a, b = divmod(int(self._gain.argmax()), len(self._gain))
            if self._gain[a, b] <= 0:
                return [np.array(self._members[i]) for i in np.flatnonzero(self._alive).tolist()]
            self._merge(a, b)

    def _price(self, count: Ints, width: Floats) -> Floats:
        return np.asarray(self._axis + count * (self._time + width))

    def _merge(self, a: int, b: int) -> None:
        """Merge group `b` into group `a`."""
        self._members[a] += self._members[b]
        self._reach[a] = np.minimum(self._reach[a], self._reach[b])
        self._width[a] += self._width[b]
        self._cost[a] += self._cost[b] - self._gain[a, b]
        self._alive[b] = False
        others = np.flatnonzero(self._alive)
        counts = num_keys(np.minimum(self._reach[others], self._reach[a]))
        gain = np.full(len(self._gain), -np.inf)
        gain[others] = self._cost[others] + self._cost[a] - self._price(counts, self._width[others] + self._width[a])
        gain[a] = -np.inf
        self._gain[a], self._gain[:, a] = gain, gain
        self._gain[b], self._gain[:, b] = -np.inf, -np.inf
