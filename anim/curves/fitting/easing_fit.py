"""Approximation of easings by the fewest cubic or linear segments within a tolerance."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from anim.arrays import Floats
from anim.curves.easing.function import CubicSegment, Easing, Function
from anim.curves.fitting.hermite_fit import SAMPLES, SAMPLING_SAFETY_FACTOR, FitTarget, fit_end_slopes, fit_errors
from anim.curves.fitting.subdivision import subdivide


@lru_cache(maxsize=256)
def fit_segments(easing: Easing, *, tolerance: float) -> tuple[CubicSegment, ...]:
    """Return an easing as cubics: the exact ones, else the fewest within `tolerance` (of the range).

    fit_segments(EASINGS["bounce-out"], tolerance=1e-3) → its four parabolas
    Raises RangeError as fit_cubic does.
    """
    if easing.exact is not None:
        return easing.exact
    return fit_cubic(easing.value, easing.derivative, easing.breakpoints, tolerance)


def fit_cubic(f: Function, df: Function, breakpoints: tuple[float, ...], tolerance: float) -> tuple[CubicSegment, ...]:
    """Return the fewest cubics that approximate f over 0 … 1, with its values and slopes at their ends.

    f, df: a continuous function of u (any shape) and its slope; ±inf is replaced by the best finite slope.
    breakpoints: interior u where the slope jumps or the function is not smooth; each becomes an end of segments.
    tolerance: the greatest |error|, 1e-7 or more; RangeError otherwise. With finite slopes the result is C1.
    fit_cubic(smootherstep, 30u²(1−u)², (), 1e-3) → 4 segments
    The error of a cubic Hermite segment of length h is about h⁴/384 · max|f⁗|; it is measured here.
    """
    path = FitTarget(lambda u: f(u)[..., None], np.ones_like, df, _difference, breakpoints)
    ends = np.array(subdivide(lambda a, b: fit_errors(path, a, b), (0.0, *breakpoints, 1.0), tolerance))
    a, b = ends[:-1], ends[1:]
    rate0, rate1 = fit_end_slopes(path, a, b)
    columns = (a, b, f(a), f(b), rate0, rate1)
    return tuple(CubicSegment(*row) for row in np.stack(columns, axis=1).tolist())


def fit_linear(f: Function, breakpoints: tuple[float, ...], tolerance: float) -> Floats:
    """Return the fewest knots u (K,), with 0 and 1, of lines that approximate f within `tolerance`.

    f must be continuous. The result contains all breakpoints. Raises RangeError for a tolerance below 1e-7.
    For an eased slerp by θ give tolerance / θ: its angle is f · θ.
    fit_linear(u², (), 1e-3) → 17 u, evenly spaced
    """

    def chord_errors(a: Floats, b: Floats) -> Floats:
        u = a[:, None] + (b - a)[:, None] * SAMPLES
        chord = f(a)[:, None] * (1 - SAMPLES) + f(b)[:, None] * SAMPLES
        return np.asarray(np.abs(f(u) - chord).max(axis=1) * SAMPLING_SAFETY_FACTOR)

    return np.array(subdivide(chord_errors, (0.0, *breakpoints, 1.0), tolerance))


def _difference(fitted: Floats, true: Floats) -> Floats:
    return np.abs(fitted - true)[..., 0]
