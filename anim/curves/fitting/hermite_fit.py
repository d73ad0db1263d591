"""Fit of single Hermite segments to a path: end slopes and errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats
from anim.curves.easing.function import Function
from anim.maths import hermite

SAMPLES = (
    1 - np.cos(np.pi * np.arange(1, 40) / 40)
) / 2  # of each segment, denser towards its ends, where roots are steep
SAMPLING_SAFETY_FACTOR = 1.01  # the greatest error is less than 1 % above the greatest sample
BREAKPOINT_OFFSET = 1e-12  # the slope at a breakpoint is evaluated at this distance inside the segment
MAX_SLOPE = 1e4  # steeper slopes are replaced by a least squares fit


@dataclass(frozen=True, slots=True)
class FitTarget:
    """Path from u (...) to points (..., D): unit tangent `direction` (..., D) at points, speed `rate` (...) per u.

    distance: the error (...) of a point (..., D) against the true one (..., D).
    breakpoints: u with different rates on both sides.
    """

    point: Function
    direction: Function
    rate: Function
    distance: Callable[[Floats, Floats], Floats]
    breakpoints: tuple[float, ...] = ()


def fit_end_slopes(path: FitTarget, a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return the start and end rates (B,) of segments from u = a (B,) to b (B,).

    They are the path's own, from inside the segment. If one is vertical, both are those of the least squared error:
    keeping the other one would make the segment thirty times shorter, to avoid an invisible kink.
    """
    return _end_slopes(path, a, b, _points(path, a, b))


def fit_errors(path: FitTarget, a: Floats, b: Floats, rates: tuple[Floats, Floats] | None = None) -> Floats:
    """Return the greatest errors (B,) of Hermite segments from a (B,) to b (B,) against the path.

    rates: those (B,) at both ends, by default those of `fit_end_slopes`.
    """
    points = _points(path, a, b)
    fitted = _segments(path, points, b - a, *(rates or _end_slopes(path, a, b, points)))
    return np.asarray(path.distance(fitted, points[:, 1:-1]).max(axis=1) * SAMPLING_SAFETY_FACTOR)


def _points(path: FitTarget, a: Floats, b: Floats) -> Floats:
    """Return the points (B, S + 2, D) of the path at a, at SAMPLES, and at b."""
    inside = a[:, None] + (b - a)[:, None] * SAMPLES
    return path.point(np.concatenate((a[:, None], inside, b[:, None]), axis=1))


def _end_slopes(path: FitTarget, a: Floats, b: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return the rates of `fit_end_slopes`; points: those of `_points`."""
    at = (_offset_breakpoints(a, path, BREAKPOINT_OFFSET), _offset_breakpoints(b, path, -BREAKPOINT_OFFSET))
    rate0, rate1 = np.split(path.rate(np.concatenate(at)), 2)
    free = np.maximum(np.abs(rate0), np.abs(rate1)) > MAX_SLOPE
    if not free.any():
        return rate0, rate1
    best0, best1 = _free_slopes(path, points, b - a)
    return np.where(free, best0, rate0), np.where(free, best1, rate1)


def _segments(path: FitTarget, points: Floats, length: Floats, rate0: Floats, rate1: Floats) -> Floats:
    """Return the points (B, S, D) at SAMPLES of segments of a length (B,) between the first and last of `points`."""
    first, last = points[:, :1], points[:, -1:]
    m0 = (length * rate0)[:, None, None] * path.direction(first)
    m1 = (length * rate1)[:, None, None] * path.direction(last)
    return hermite.evaluate(SAMPLES[:, None], first, m0, last, m1)


def _free_slopes(path: FitTarget, points: Floats, length: Floats) -> tuple[Floats, Floats]:
    """Return the rates (B,) at both ends with the least squared error at SAMPLES."""
    none = np.zeros_like(length)
    left = points[:, 1:-1] - _segments(path, points, length, none, none)
    length, s = length[:, None, None], SAMPLES[:, None]
    shape0 = length * s * (1 - s) ** 2 * path.direction(points[:, :1])
    shape1 = -length * s * s * (1 - s) * path.direction(points[:, -1:])
    p00, p01, p11 = _product(shape0, shape0), _product(shape0, shape1), _product(shape1, shape1)
    r0, r1 = _product(left, shape0), _product(left, shape1)
    determinant = p00 * p11 - p01 * p01
    return (r0 * p11 - r1 * p01) / determinant, (r1 * p00 - r0 * p01) / determinant


def _product(x: Floats, y: Floats) -> Floats:
    return np.asarray((x * y).sum(axis=(1, 2)))


def _offset_breakpoints(u: Floats, path: FitTarget, by: float) -> Floats:
    at_break: Bools = np.isin(u, path.breakpoints)
    return np.where(at_break, u + by, u)
