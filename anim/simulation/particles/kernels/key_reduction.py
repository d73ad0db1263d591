"""Greedy removal of keys of piecewise cubic paths, within a true bound; compiled."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.simulation.particles.kernels.vectors import Vector, add, hermite, hermite_velocity, length
from anim.skinning.kernels.jit import jit


@jit
def keep_keys(offsets: Ints, times: Floats, x: Floats, v_in: Floats, v_out: Floats, bound: float) -> Bools:
    """Return which of the keys (K,) of particles, rows offsets[p] … offsets[p + 1], to keep: greedily the longest.

    Between kept keys the cubic through both, with their velocities, is nowhere farther than `bound` m from the path.
    Keys whose velocities differ before and after, which are impacts, stay.
    """
    kept = np.ones(len(times), np.bool_)
    for p in range(len(offsets) - 1):
        start, last = offsets[p], offsets[p + 1] - 1
        while start < last:
            end = start + 1
            while end < last and _is_smooth(v_in[end], v_out[end]):
                if _distance(times, x, v_in, v_out, start, end + 1) > bound:
                    break
                end += 1
            kept[start + 1 : end] = False
            start = end
    return kept


@jit
def largest_error(times: Floats, x: Floats, v_in: Floats, v_out: Floats, offsets: Ints, kept: Bools) -> float:
    """Return a bound in m of the distance between the path and the one through the kept keys."""
    largest = 0.0
    for p in range(len(offsets) - 1):
        start = offsets[p]
        for k in range(offsets[p] + 1, offsets[p + 1]):
            if kept[k]:
                if k > start + 1:
                    largest = max(largest, _distance(times, x, v_in, v_out, start, k))
                start = k
    return largest


@jit
def _is_smooth(before: Floats, after: Floats) -> bool:
    return bool(before[0] == after[0] and before[1] == after[1] and before[2] == after[2])


@jit
def _row(rows: Floats, k: int) -> Vector:
    return (rows[k, 0], rows[k, 1], rows[k, 2])


@jit
def _distance(times: Floats, x: Floats, v_in: Floats, v_out: Floats, start: int, end: int) -> float:
    """Bound of the distance between the path and one cubic from key to key.

    On each segment the difference is a cubic, which is inside the hull of its Bézier points.
    """
    h = times[end] - times[start]
    x0, v0, x1, v1 = _row(x, start), _row(v_out, start), _row(x, end), _row(v_in, end)
    largest = 0.0
    for k in range(start, end):
        third = (times[k + 1] - times[k]) / 3
        for at, velocity, sign in ((k, _row(v_out, k), 1.0), (k + 1, _row(v_in, k + 1), -1.0)):
            u = (times[at] - times[start]) / h
            difference = add(hermite(u, h, x0, v0, x1, v1), -1.0, _row(x, at))
            slope = add(hermite_velocity(u, h, x0, v0, x1, v1), -1.0, velocity)
            largest = max(largest, length(difference), length(add(difference, sign * third, slope)))
    return largest
