"""Coordinates and parameter of cubic Bézier curves from 0 to 1: CSS easings, weighted tangents."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats

TOLERANCE = 4e-16  # a step, or a relative error, below this is rounding
NUM_TABLE = 257  # points of a curve on which the search begins
MAX_ITERATIONS = 60  # bisection alone takes 53; Newton's method about 5


def evaluate(s: Floats, p1: Floats | float, p2: Floats | float) -> Floats:
    """Return the coordinate at s of the Bézier 0, p1, p2, 1; exactly 0 and 1 at the ends."""
    r = 1 - s
    return np.asarray(3 * r * r * s * p1 + 3 * r * s * s * p2 + s * s * s)


def slope(s: Floats, p1: Floats | float, p2: Floats | float) -> Floats:
    """Return the derivative of `evaluate` by s."""
    r = 1 - s
    return np.asarray(3 * r * r * p1 + 6 * r * s * (p2 - p1) + 3 * s * s * (1 - p2))


def _bracket(time: Floats, x1: Floats | float, x2: Floats | float) -> tuple[Floats, Floats, Floats]:
    """Return bounds (N,) of the `parameter` at each time (N,), and the one on the chord between them."""
    s = np.linspace(0.0, 1.0, NUM_TABLE)
    times = evaluate(s, x1, x2)
    i = np.clip(np.searchsorted(times, time, side="right"), 1, NUM_TABLE - 1)
    rise = times[i] - times[i - 1]
    share = (time - times[i - 1]) / np.where(rise > 0, rise, 1.0)
    low, high = s[i - 1], s[i]
    return low, high, low + np.clip(share, 0.0, 1.0) * (high - low)


def parameter(time: Floats, x1: Floats | float, x2: Floats | float) -> Floats:
    """Return s with evaluate(s, x1, x2) = time, all of them 0 … 1 and of any shape.

    Newton's method with bisection as a safeguard.
    """
    full = np.broadcast_arrays(np.asarray(time, np.float64), x1, x2)
    goal, p1, p2 = (each.ravel() for each in full)
    low, high, solution = np.zeros(goal.size), np.ones(goal.size), goal.copy()
    is_one_curve = np.ndim(x1) == np.ndim(x2) == 0
    if is_one_curve:  # a table of it halves the iterations
        low, high, solution = _bracket(goal, x1, x2)
    left = np.arange(goal.size)
    for _ in range(MAX_ITERATIONS):
        s = solution[left]
        a, b = (x1, x2) if is_one_curve else (p1[left], p2[left])
        error, rate = evaluate(s, a, b) - goal[left], slope(s, a, b)
        least, most = np.where(error <= 0, s, low[left]), np.where(error >= 0, s, high[left])
        step = s - error / np.where(rate > 0, rate, 1.0)
        inside = (rate > 0) & (step >= least) & (step <= most)
        met = np.abs(error) <= TOLERANCE * goal[left]  # a step from rounding alone can go anywhere if the rate is tiny
        following = np.where(met, s, np.where(inside, step, (least + most) / 2))
        solution[left], low[left], high[left] = following, least, most
        left = left[(np.abs(following - s) > TOLERANCE) & ~met]
        if not left.size:
            break
    return solution.reshape(full[0].shape)
