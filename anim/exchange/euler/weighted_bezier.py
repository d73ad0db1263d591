"""Weighted Bézier segments: handles of any length, as in Maya's weighted tangents and Blender."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats

DEFAULT_WEIGHT = 1 / 3  # of a segment; with both handles of this length the cubic equals `maths.hermite`
MAX_ITERATIONS = 60  # bracket halvings at worst; usually six steps


def evaluate(
    share: Floats, p0: Floats, rise0: Floats, p1: Floats, rise1: Floats, weights: tuple[Floats, Floats]
) -> Floats:
    """Return the value at `share` (…), 0 … 1 of the segment's duration, of the Bézier cubic from p0 to p1.

    rise0, rise1: slopes per fraction: per second times the segment's duration. weights: 0 … 1, lengths of the handles
    after the first key and before the second, as fractions of the segment.
    evaluate(0.5, 0, 0, 1, 0, (1/3, 1/3)) → 0.5
    """
    u = parameter(share, *weights)
    return _bezier(u, p0, p0 + weights[0] * rise0, p1 - weights[1] * rise1, p1)


def parameter(share: Floats, leaving: Floats, arriving: Floats) -> Floats:
    """Return the cubic's parameter u (…) at the fraction `share` of the segment's duration.

    leaving, arriving: handle lengths, 0 … 1: then time is monotonic in u. Newton's method, with bisection outside the
    bracket.
    """
    share, leaving, arriving = np.broadcast_arrays(share, leaving, arriving)
    low, high, u = np.zeros(share.shape), np.ones(share.shape), share.astype(np.float64)
    for _ in range(MAX_ITERATIONS):
        v = 1 - u
        off = 3 * leaving * u * v * v + 3 * (1 - arriving) * u * u * v + u**3 - share
        low, high = np.where(off <= 0, u, low), np.where(off >= 0, u, high)
        slope = 3 * leaving * v * v + 6 * (1 - arriving - leaving) * u * v + 3 * arriving * u * u
        with np.errstate(divide="ignore", invalid="ignore"):
            step = u - off / slope
        following = np.where((step > low) & (step < high), step, (low + high) / 2)
        if (np.abs(following - u) < 1e-15).all():
            break
        u = following
    return u


def _bezier(u: Floats, p0: Floats, p1: Floats, p2: Floats, p3: Floats) -> Floats:
    v = 1 - u
    return v**3 * p0 + 3 * u * v * v * p1 + 3 * u * u * v * p2 + u**3 * p3
