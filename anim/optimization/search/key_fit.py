"""Key values that serve the whole motion between them, not only the moments at which they stand."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.optimization.search import playback
from anim.sampling.track import KeyInterval

ENDS = 4.0  # weight of the first and the last moment: loops and cuts must still meet
STEPS = 1  # Gauss-Newton steps for rotations
DENSE = 200_000  # numbers; longer clips are solved by bands

Solver: TypeAlias = Callable[[Floats], Floats]  # values (W, n) → keys (K, n)


class KeyFit:
    """Least squares on one time axis, prepared once for all tracks that use it."""

    def __init__(self, place: KeyInterval, keys: int) -> None:
        weights = np.ones(len(place.u))
        weights[0] = weights[-1] = ENDS
        self._place = place
        is_small = len(place.u) * keys <= DENSE
        self.numbers = len(place.u) * (keys if is_small else 4)  # that are kept, about
        self._solved = (_dense if is_small else _banded)(place, keys, weights)

    def vectors(self, values: Floats) -> Floats:
        """Return keys (K, G, C) whose lines are nearest to the values (W, G, C)."""
        return self._solved(values.reshape(len(values), -1)).reshape(-1, *values.shape[1:])

    def rotations(self, values: Floats, keys: Floats) -> Floats:
        """Return unit keys (K, G, 4) whose arcs are nearest to the rotations (W, G, 4), from `keys` on.

        Only what is left at a right angle to the curve counts: a linear fit of quaternions would also make up for the
        chord's shorter length, by keys that lie beside the motion.
        """
        for _ in range(STEPS):
            shown = playback.slerp_raw(keys, self._place)
            near = np.where(quaternion.dot(values, shown)[..., None] < 0, -values, values)
            off = near - shown
            off -= quaternion.dot(off, shown)[..., None] * shown
            keys = quaternion.normalize(keys + self.vectors(off))
        return keys


def _dense(place: KeyInterval, keys: int, weights: Floats) -> Solver:
    """One small matrix for all there is to do."""
    hats = np.zeros((len(weights), keys))
    every = np.arange(len(weights))
    hats[every, place.left] += 1 - place.u
    hats[every, place.right] += place.u
    weighted = hats.T * weights
    solve = np.linalg.solve(weighted @ hats, weighted)
    return lambda values: np.asarray(solve @ values)


def _banded(place: KeyInterval, keys: int, weights: Floats) -> Solver:
    """The same in time and memory that grow with the number of keys, not with its square: hats meet only neighbors."""
    from scipy.linalg import solveh_banded
    from scipy.sparse import csr_array

    every = np.tile(np.arange(len(weights)), 2)
    shares = np.concatenate((1 - place.u, place.u))
    hats = csr_array((shares, (every, np.concatenate((place.left, place.right)))), shape=(len(weights), keys))
    weighted = (hats * weights[:, None]).T.tocsr()
    normal = weighted @ hats
    bands = np.zeros((2, keys))
    bands[0, 1:], bands[1] = normal.diagonal(1), normal.diagonal()
    return lambda values: np.asarray(solveh_banded(bands, weighted @ values))
