"""Bounds of the difference of two versions' quaternions within an interval, with two derivatives.

Both versions satisfy q″ = −λq − 2ρq′ + e, see `quaternion_bounds`, so that the difference d of two quaternions
satisfies

    |d″| ≤ λ|d| + |Δλ||q| + 2ρ|d′| + 2|Δρ||q′| + |Δe|

In an interval of length h, |d| exceeds the larger one of both ends by at most h²/8 · sup|d″|, and |d′| by at most
h/2 · sup|d″|. With that, the line above has sup|d″| on both sides, and is solved for it. All its terms vanish for equal
versions.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats
from anim.measure.continuous_bound.quaternion_bounds import ChordBounds, QuaternionBounds

MIN_COEFFICIENT = 1e-3  # of sup|d″|, after solving; with a smaller one there is no bound


def difference_bounds(
    a: QuaternionBounds, b: QuaternionBounds, between: tuple[ChordBounds, ChordBounds, Bools], h: Floats
) -> Floats:
    """Return bounds (3, P, L) of |d| and its first two derivatives, for b's quaternions minus a's.

    between: both as lines, and the mask (P, L) of lines normalized in both. h: (L,) s.
    """
    start, rate = (np.sqrt(_squares(x, y).max(axis=0)) for x, y in ((b.value, a.value), (b.slope, a.slope)))
    pull, drag = _between_lines(*between[:2], h)
    pull = np.where(between[2], pull, _apart(a.lambda_, b.lambda_) + h / 2 * (a.lambda_rate + b.lambda_rate))
    drag = np.where(between[2], drag, _apart(a.rho, b.rho) + h / 2 * (a.rho_rate + b.rho_rate))
    left = 1 - b.max_lambda * h * h / 8 - b.max_rho * h
    known = b.max_lambda * start + pull * a.size + 2 * b.max_rho * rate + 2 * a.speed * drag + _own(a, b, h)
    loose = a.bend + b.bend
    bend = np.where(left > MIN_COEFFICIENT, np.minimum(known / np.maximum(left, MIN_COEFFICIENT), loose), loose)
    return np.stack((start + h * h / 8 * bend, rate + h / 2 * bend, bend))


def _between_lines(a: ChordBounds, b: ChordBounds, h: Floats) -> tuple[Floats, Floats]:
    """Bounds of |Δλ| and |Δρ| on normalized lines.

    There λ = wedge / |c|⁴ and ρ = c·c′ / |c|²: of a constant, a square of time and a line, and so are differences.
    """
    square = _apart(a.square, b.square) + h * h / 4 * np.abs(b.rate - a.rate)
    fourth = square * (a.farthest + b.farthest)
    both = a.nearest * b.nearest
    pull = np.abs(b.wedge - a.wedge) / b.nearest**2 + a.wedge * fourth / both**2
    return pull, _apart(a.along, b.along) / b.nearest + np.abs(a.along).max(axis=0) * square / both


def _own(a: QuaternionBounds, b: QuaternionBounds, h: Floats) -> Floats | float:
    if a.own is None and b.own is None:
        return 0.0
    square = _squares(np.zeros_like(a.value) if b.own is None else b.own, 0.0 if a.own is None else a.own)
    return np.asarray(np.sqrt(square.max(axis=0)) + h / 2 * (a.residual_rate + b.residual_rate))


def _squares(x: Floats, y: Floats | float) -> Floats:
    """Squares of the distances (2, ...) of vectors (2, 4, ...)."""
    apart = x - y
    apart *= apart
    return np.asarray(apart.sum(axis=1))


def _apart(a: Floats, b: Floats) -> Floats:
    """The larger of two differences, from (2, ...)."""
    return np.asarray(np.abs(b - a).max(axis=0))
