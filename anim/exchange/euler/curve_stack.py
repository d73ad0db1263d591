"""Many curves in one array: evaluation and facts of all of them by single numpy calls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.curves.fitting.stacked_keys import distinct_times
from anim.exchange.euler.curve import DEFAULT_WEIGHT, HANDLES, WEIGHTS, Curve, Keys, Mode, control_length, interpolate
from anim.sampling.track_stack import StackedTimes


class CurveStack:
    """M curves (one or more) with their keys one after the other, each at its own times.

    Values are those of `curve.evaluate` and `curve.travel`, to the bit.
    """

    def __init__(self, curves: Sequence[Curve]) -> None:
        values = np.concatenate([curve.values for curve in curves])
        modes = np.concatenate([curve.modes for curve in curves])
        times = np.concatenate([curve.time_axis.times for curve in curves])
        handles = (_join(curves, name) for name in HANDLES)
        self._set_keys(Keys(times, values, modes, *handles), np.array([len(curve.values) for curve in curves]))
        self._is_weighted = np.array(
            [curve.in_weights is not None or curve.out_weights is not None for curve in curves]
        )

    def _set_keys(self, keys: Keys, counts: Ints) -> None:
        self._keys, self._stacked = keys, StackedTimes(keys.times, counts)
        self._starts, self._counts = self._stacked.starts, counts
        self._last: Ints = self._starts + counts - 1

    def round_times(self) -> None:
        """Round all times to float32, and drop keys before another one of the same time."""
        stored = self._keys.times.astype(np.float32).astype(np.float64)
        kept = np.append(np.diff(stored) > 0, True)
        kept[self._last] = True
        keys = self._keys._replace(times=stored)
        if not kept.all():
            parts = {name: part[kept] for name, part in keys._asdict().items() if part is not None}
            keys = Keys(**parts)
        self._set_keys(keys, np.add.reduceat(kept, self._starts, dtype=np.int64))

    def evaluate(self, which: Ints, at: Floats, *, before: bool = False) -> Floats:
        """Return the values (F,) of curves `which` (F,) at times `at` (F,) in seconds; before: left limits."""
        left, right = self._stacked.find(which, at, before=before)
        values: Floats = self._keys.values[left]
        several = self._counts[which] > 1
        for chosen, keys in self._by_kind(which, left, several):
            values[chosen] = interpolate(keys, left[chosen], right[chosen], at[chosen])
        return values

    def travel(self, which: Ints, a: Floats, b: Floats) -> Floats:
        """Return bounds (B,) of the total variation of curves `which` (B,) from times a to b (B,)."""
        found = np.abs(self.evaluate(which, b, before=True) - self.evaluate(which, a))
        left, right = self._stacked.find(which, a)
        cubic = (self._keys.modes[left] == Mode.CUBIC) & (a >= self._keys.times[self._starts[which]])
        for chosen, keys in self._by_kind(which, left, cubic):
            found[chosen] = control_length(keys, left[chosen], right[chosen])
        return found

    def knots(self, curves: Ints, owners: Ints) -> tuple[Ints, Floats]:
        """Return the distinct key times (T,) of each owner's curves, increasing, after the owner of each (T,).

        curves: (n,) some of the curves. owners: (n,) of each, not decreasing.
        """
        counts = self._counts[curves]
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        times = self._keys.times[np.repeat(self._starts[curves], counts) + within]
        return distinct_times(np.repeat(owners, counts), times)

    @property
    def is_constant(self) -> Bools:
        """True (M,) for curves with equal values and level tangents."""
        moving = self._keys.values != np.repeat(self._keys.values[self._starts], self._counts)
        if self._keys.in_tangents is not None and self._keys.out_tangents is not None:
            arriving, leaving = self._keys.in_tangents != 0, self._keys.out_tangents != 0
            arriving[self._starts], leaving[self._last] = False, False
            moving |= arriving | leaving
        return ~np.logical_or.reduceat(moving, self._starts)

    @property
    def is_stepped(self) -> Bools:
        """True (M,) for curves with steps alone."""
        steps = self._keys.modes == Mode.STEP
        steps[self._last] = True
        return np.asarray(np.logical_and.reduceat(steps, self._starts))

    def _by_kind(self, which: Ints, left: Ints, among: Bools) -> list[tuple[Ints, Keys]]:
        """Indices of those among the queries by kind of segment, each with keys that have handles of this kind."""
        if self._keys.in_tangents is None:
            return _some(among, self._keys)
        cubic = among & (self._keys.modes[left] == Mode.CUBIC)
        weighted = cubic & self._is_weighted[which]
        plain = self._keys._replace(in_weights=None, out_weights=None)
        return [
            *_some(among & ~cubic, plain._replace(in_tangents=None, out_tangents=None)),
            *_some(cubic & ~weighted, plain),
            *_some(weighted, self._keys),
        ]


def _some(mask: Bools, keys: Keys) -> list[tuple[Ints, Keys]]:
    found = np.flatnonzero(mask)
    return [(found, keys)] if len(found) else []


def _join(curves: Sequence[Curve], name: str) -> Floats | None:
    """One handle of all keys; None if no curve has it."""
    parts = [getattr(curve, name) for curve in curves]
    if all(part is None for part in parts):
        return None
    otherwise = DEFAULT_WEIGHT if name in WEIGHTS else 0.0
    pairs = zip(parts, curves, strict=True)
    return np.concatenate([np.full(len(curve.values), otherwise) if part is None else part for part, curve in pairs])
