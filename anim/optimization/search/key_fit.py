"""Least-squares fit of key values to the motion between keys, of many tracks at once.

Arrays are (C, T, ·): component, track, then key or time.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.optimization.search import playback
from anim.optimization.search.key_intervals import KeyIntervals

NUM_GAUSS_NEWTON_STEPS = 1  # for rotations
MAX_UNBANDED_KEYS = 512  # keys of an axis up to which all tracks are solved key by key; longer ones by a banded solver


class KeyFit:
    """Least squares on some time axes, prepared once for all tracks that use them."""

    def __init__(self, axes: KeyIntervals, weights: Floats) -> None:
        """weights: (A, W), of each axis' times."""
        self._axes = axes
        self._weights = weights
        self._first = axes.at.copy()  # (A, K) the first time of each interval, that of its left key
        self._first[:, 0] = 0
        self._is_interval = axes.is_key
        every = np.arange(len(axes.counts))
        self._is_interval[every, axes.counts - 1] = axes.counts == 1
        near, far = weights * (1 - axes.u), weights * axes.u
        parts = self._sums(np.stack((near * (1 - axes.u), far * axes.u, near * axes.u)), every)
        self._diagonal = parts[0]
        self._diagonal[:, 1:] += parts[1, :, :-1]
        self._diagonal[~axes.is_key] = 1.0
        self._beside = parts[2, :, :-1]

    def vectors(self, values: Floats, axis_of: Ints) -> Floats:
        """Return keys (C, T, K) whose linear interpolation is nearest to the values (C, T, W).

        axis_of: (T,), the index of each track's axis.
        """
        weighted = values * self._weights[axis_of]
        far = weighted * self._axes.u[axis_of]
        sums = self._sums(np.concatenate((weighted - far, far)), axis_of)
        right = sums[: len(values)]
        right[..., 1:] += sums[len(values) :, :, :-1]
        return self._solve(right, axis_of)

    def rotations(self, values: Floats, keys: Floats, axis_of: Ints) -> Floats:
        """Return unit keys (4, T, K) whose slerp is nearest to the rotations (4, T, W), starting at `keys`.

        Only the residual perpendicular to the curve counts: a linear fit of quaternions would also compensate the
        chord's shorter length, with keys that deviate from the motion.
        """
        left, u = self._axes.left[axis_of], self._axes.u[axis_of]
        for _ in range(NUM_GAUSS_NEWTON_STEPS):
            shown = playback.slerp_raw(keys, left, u)
            error = np.where(playback.dot(values, shown) < 0, -values, values)
            error -= shown
            error -= playback.dot(error, shown) * shown
            keys = playback.normalize(keys + self.vectors(error, axis_of))
        return keys

    def _sums(self, values: Floats, axis_of: Ints) -> Floats:
        """The sums (C, T, K) of values (C, T, W) over the intervals after each key; 0 after the last one."""
        inside = self._is_interval[axis_of]
        sums = np.zeros((len(values), *inside.shape))
        firsts = (self._first[axis_of] + values.shape[2] * np.arange(len(axis_of))[:, None])[inside]
        sums[:, inside] = np.add.reduceat(values.reshape(len(values), -1), firsts, axis=1)
        return sums

    def _solve(self, right: Floats, axis_of: Ints) -> Floats:
        """Keys (C, T, K) from the right sides of the normal equations: hat functions overlap only their neighbors'."""
        is_long = self._axes.counts[axis_of] > MAX_UNBANDED_KEYS
        if right.shape[2] > MAX_UNBANDED_KEYS:  # of some axis, not always one of these tracks'
            solved = self._solve_banded(right, axis_of, is_long)
            if not is_long.all():
                short = right[:, ~is_long, :MAX_UNBANDED_KEYS]
                solved[:, ~is_long, :MAX_UNBANDED_KEYS] = self._solve(short, axis_of[~is_long])
            return solved
        pivots, factors = self._factors
        found = np.ascontiguousarray(np.moveaxis(right, 2, 0))  # (K, C, T)
        factor = np.ascontiguousarray(factors[: len(found) - 1, axis_of])
        for k in range(1, len(found)):
            found[k] -= factor[k - 1] * found[k - 1]
        found /= pivots[: len(found), None, axis_of]
        for k in range(len(found) - 2, -1, -1):
            found[k] -= factor[k] * found[k + 1]
        return np.moveaxis(found, 0, 2)

    @cached_property
    def _factors(self) -> tuple[Floats, Floats]:
        """Pivots (K, A) and factors (K - 1, A) of the normal matrices, L·D·Lᵀ with one diagonal beside the main one.

        Of axes with more than MAX_UNBANDED_KEYS keys, only those of the first ones.
        """
        pivots = self._diagonal[:, :MAX_UNBANDED_KEYS].T.copy()
        beside = np.ascontiguousarray(self._beside[:, : MAX_UNBANDED_KEYS - 1].T)
        factors = np.empty_like(beside)
        for k in range(1, len(pivots)):
            factors[k - 1] = beside[k - 1] / pivots[k - 1]
            pivots[k] -= factors[k - 1] * beside[k - 1]
        return pivots, factors

    def _solve_banded(self, right: Floats, axis_of: Ints, is_long: Bools) -> Floats:
        """The same for tracks (T,) on long axes: each is one banded system for all of its tracks."""
        from scipy.linalg import solveh_banded

        found = np.zeros_like(right)
        for axis in sorted(set(axis_of[is_long].tolist())):
            mine, count = np.flatnonzero(axis_of == axis), int(self._axes.counts[axis])
            some = right[:, mine, :count]
            bands = np.zeros((2, count))
            bands[0, 1:], bands[1] = self._beside[axis, : count - 1], self._diagonal[axis, :count]
            solved = solveh_banded(bands, some.reshape(-1, count).T)
            found[:, mine, :count] = solved.T.reshape(some.shape)
        return found
