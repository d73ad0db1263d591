"""Tangents of C2 curves (continuous acceleration), solved by scipy for all keys at once.

A piecewise cubic is exact as CUBICSPLINE keys of its values and slopes.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.curves.tangents.rule import SplineKeys, extend_loop


def natural(times: Floats, values: Floats) -> SplineKeys:
    """Return the C2 curve with zero end acceleration: the least integrated squared acceleration."""
    return _cubic(times, values, ends="natural")


def clamped(times: Floats, values: Floats) -> SplineKeys:
    """Return the C2 curve through the keys with zero end speed."""
    return _cubic(times, values, ends="clamped")


def with_end_slopes(times: Floats, values: Floats, start: Floats, end: Floats) -> SplineKeys:
    """Return the C2 curve through the keys with these slopes (C,) at its ends."""
    from scipy.interpolate import CubicSpline

    slopes = np.asarray(CubicSpline(times, values, axis=0, bc_type=((1, start), (1, end)))(times, 1))
    return SplineKeys(values, slopes, slopes)


def periodic(times: Floats, values: Floats) -> SplineKeys:
    """Return the C2 curve through the keys with equal speed and acceleration at start and end.

    If the last value is not the first, the difference is the displacement per cycle, which continues in the next cycle.
    """
    duration, way = times[-1] - times[0], values[-1] - values[0]
    still = values - (times - times[0])[:, None] / duration * way
    still[-1] = still[0]
    slopes = _cubic(times, still, ends="periodic").out_tangents + way / duration
    slopes[-1] = slopes[0]
    return SplineKeys(values, slopes, slopes)


def bspline(times: Floats, values: Floats) -> SplineKeys:
    """Return the C2 curve that approximates the keys and interpolates the first and last.

    With even spacing the keys are the control points of the uniform cubic B-spline, value (v₋ + 4v + v₊) / 6. With any
    spacing the control points are on the lines between keys at means of three times, so straight runs stay straight.
    Source: Schoenberg 1967 (variation diminishing spline); scipy's BSpline.
    """
    knots = np.concatenate((times[:1].repeat(3), times, times[-1:].repeat(3)))
    return _fit_bspline(knots, times, values, times, values)


def cyclic_bspline(times: Floats, values: Floats) -> SplineKeys:
    """Return the periodic form of `bspline`: both ends are approximated too, and meet each other."""
    more_times, more_values = extend_loop(times, values, 3)
    keys = _fit_bspline(more_times, more_times, more_values, times, values)
    keys.values[-1] = keys.values[0] + (values[-1] - values[0])
    keys.out_tangents[-1] = keys.out_tangents[0]
    return keys


def _cubic(times: Floats, values: Floats, *, ends: str) -> SplineKeys:
    from scipy.interpolate import CubicSpline

    if len(times) == 2 and ends != "clamped":
        slopes = np.repeat((values[1:] - values[:1]) / (times[1] - times[0]), 2, axis=0)
    else:
        slopes = np.asarray(CubicSpline(times, values, axis=0, bc_type=ends)(times, 1))
    return SplineKeys(values, slopes, slopes)


def _fit_bspline(knots: Floats, lines_t: Floats, lines_v: Floats, times: Floats, values: Floats) -> SplineKeys:
    """Return the B-spline on `knots`, control points on the lines through lines_t, lines_v, at `times`."""
    from scipy.interpolate import BSpline

    centers = (knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3
    controls = np.stack([np.interp(centers, lines_t, column) for column in lines_v.T], axis=1)
    spline = BSpline(knots, controls, 3)
    passed, slopes = np.asarray(spline(times)), np.asarray(spline(times, 1))
    off = passed - values
    return SplineKeys(passed, slopes, slopes, float(np.sqrt((off * off).sum(axis=1).max())))
