"""Least-squares fit of key values to the motion between keys."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.optimization.search import playback
from anim.sampling.track import KeyInterval

END_WEIGHT = 4.0  # weight of the first and the last time: loops and cuts must stay continuous
NUM_GAUSS_NEWTON_STEPS = 1  # for rotations
MAX_DENSE_VALUES = 200_000  # matrix entries; longer clips use a banded solver

Solver: TypeAlias = Callable[[Floats], Floats]  # values (W, n) → keys (K, n)


class KeyFit:
    """Least squares on one time axis, prepared once for all tracks that use it."""

    def __init__(self, place: KeyInterval, keys: int) -> None:
        weights = np.ones(len(place.u))
        weights[0] = weights[-1] = END_WEIGHT
        self._interval = place
        is_small = len(place.u) * keys <= MAX_DENSE_VALUES
        self.num_values = len(place.u) * (keys if is_small else 4)  # approximate, for the cache's limit
        self._solve = (_dense if is_small else _banded)(place, keys, weights)

    def vectors(self, values: Floats) -> Floats:
        """Return keys (K, G, C) whose linear interpolation is nearest to the values (W, G, C)."""
        return self._solve(values.reshape(len(values), -1)).reshape(-1, *values.shape[1:])

    def rotations(self, values: Floats, keys: Floats) -> Floats:
        """Return unit keys (K, G, 4) whose slerp is nearest to the rotations (W, G, 4), starting at `keys`.

        Only the residual perpendicular to the curve counts: a linear fit of quaternions would also compensate the
        chord's shorter length, with keys that deviate from the motion.
        """
        for _ in range(NUM_GAUSS_NEWTON_STEPS):
            shown = playback.slerp_raw(keys, self._interval)
            near = np.where(quaternion.dot(values, shown)[..., None] < 0, -values, values)
            error = near - shown
            error -= quaternion.dot(error, shown)[..., None] * shown
            keys = quaternion.normalize(keys + self.vectors(error))
        return keys


def _dense(place: KeyInterval, keys: int, weights: Floats) -> Solver:
    """Solver with one dense matrix."""
    hats = np.zeros((len(weights), keys))
    every = np.arange(len(weights))
    hats[every, place.left] += 1 - place.u
    hats[every, place.right] += place.u
    weighted = hats.T * weights
    solve = np.linalg.solve(weighted @ hats, weighted)
    return lambda values: np.asarray(solve @ values)


def _banded(place: KeyInterval, keys: int, weights: Floats) -> Solver:
    """Solver in time and memory linear in the number of keys: hat functions overlap only their neighbors'."""
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
