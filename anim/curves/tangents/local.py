"""Tangents from a key's neighbors: h_k is the duration, d_k the mean speed from key k to k + 1.

Monotone and Akima come from scipy.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.curves.tangents.rule import TangentRule, local_rule
from anim.errors import RangeError

MIN_KNOT_RATIO = 1e-9  # of the longest interval: separates repeated points in the centripetal parameter


def bessel(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return the slopes of parabolas through three keys; at the ends of the first and last three.

    (h_k d_{k−1} + h_{k−1} d_k) / (h_{k−1} + h_k). Exact for parabolas, whatever the spacing.
    """
    slopes = _parabola_slopes(times, values)
    return slopes, slopes


def catmull_rom(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return (v_{k+1} − v_{k−1}) / (t_{k+1} − t_{k−1}); at the ends the slopes of time_aware."""
    slopes = _parabola_slopes(times, values).copy()
    slopes[1:-1] = (values[2:] - values[:-2]) / (times[2:] - times[:-2])[:, None]
    return slopes, slopes


def flat(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return slopes 0: zero speed at every key."""
    none = np.zeros_like(values)
    return none, none


def centripetal(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return the slopes of time_aware in the parameter √distance, for a path without cusps and loops.

    The path is C1 in that parameter and G1 in time: speed jumps at keys unless key times are spaced accordingly.
    A repeated point has zero speed. Source: Yuksel et al. 2011; Barry & Goldman 1988.
    """
    steps = np.diff(values, axis=0)
    knots = np.sqrt(np.sqrt((steps * steps).sum(axis=1)))
    if not knots.any():
        return flat(times, values)
    knots = np.maximum(knots, MIN_KNOT_RATIO * knots.max())
    slopes = _parabola_slopes(np.append(0.0, np.cumsum(knots)), values)
    rates = (knots / np.diff(times))[:, None]
    return slopes * np.concatenate((rates[:1], rates)), slopes * np.concatenate((rates, rates[-1:]))


def monotone(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return slopes of a curve that stays in the range of neighboring keys, so no feet below the floor.

    Source: Fritsch & Butland 1984, by scipy's PchipInterpolator.
    """
    from scipy.interpolate import PchipInterpolator

    with np.errstate(over="ignore"):  # 1 / denormal slope is inf, and its inverse 0, as intended
        slopes = np.asarray(PchipInterpolator(times, values, axis=0).derivative()(times))
    return slopes, slopes


def akima(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return slopes weighted towards the side of less change, robust to outlier keys (Akima 1970, scipy)."""
    from scipy.interpolate import Akima1DInterpolator

    if len(times) == 2:
        return bessel(times, values)
    slopes = np.asarray(Akima1DInterpolator(times, values, axis=0).derivative()(times))
    return slopes, slopes


def cardinal(tension: float) -> TangentRule:
    """Return the rule of Catmull-Rom slopes times 1 − tension: 0 is catmull-rom, 1 flat, below 0 steeper.

    Raises RangeError for a tension outside −1 … 1.
    """
    _check(tension=tension)

    def slopes(times: Floats, values: Floats) -> tuple[Floats, Floats]:
        scaled = catmull_rom(times, values)[0] * (1 - tension)
        return scaled, scaled

    return local_rule(f"cardinal({tension:g})", slopes)


def tcb(tension: float, continuity: float, bias: float) -> TangentRule:
    """Return the rule with tension (1: slope 0), continuity (0: C1), bias (±1: overshoot after, before).

    Each in −1 … 1, RangeError otherwise; (0, 0, 0) is catmull-rom. The end slopes are catmull-rom's times 1 − tension.
    Source: Kochanek & Bartels 1984, with their correction for uneven spacing.
    """
    _check(tension=tension, continuity=continuity, bias=bias)
    t, c, b = tension, continuity, bias

    def slopes(times: Floats, values: Floats) -> tuple[Floats, Floats]:
        ends = _parabola_slopes(times, values) * (1 - t)
        span = (times[2:] - times[:-2])[:, None]
        left, right = (values[1:-1] - values[:-2]) / span, (values[2:] - values[1:-1]) / span
        before, after = ends.copy(), ends.copy()
        before[1:-1] = (1 - t) * ((1 - c) * (1 + b) * left + (1 + c) * (1 - b) * right)
        after[1:-1] = (1 - t) * ((1 + c) * (1 + b) * left + (1 - c) * (1 - b) * right)
        return before, after

    return local_rule(f"tcb({t:g}, {c:g}, {b:g})", slopes)


def _parabola_slopes(times: Floats, values: Floats) -> Floats:
    """Return the slopes (K, C) at the keys of parabolas through three keys; of the chord for two keys."""
    h = np.diff(times)[:, None]
    d = np.diff(values, axis=0) / h
    if len(times) == 2:
        return np.repeat(d, 2, axis=0)
    inner = (h[1:] * d[:-1] + h[:-1] * d[1:]) / (h[:-1] + h[1:])
    first = d[:1] + (d[0] - d[1]) * h[0] / (h[0] + h[1])
    last = d[-1:] + (d[-1] - d[-2]) * h[-1] / (h[-1] + h[-2])
    return np.concatenate((first, inner, last))


def _check(**parameters: float) -> None:
    for name, number in parameters.items():
        if not -1 <= number <= 1:
            raise RangeError(f"{name} is {number:g} (expected -1 … 1)")
