"""Weights of morph targets as those of blend shapes within 0 … 1, to which Blender and Unity clamp them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats

WEIGHT_TOLERANCE = 1e-6  # beyond 0 … 1, of rounding
NEGATIVE_SUFFIX = "_negative"  # of the names of shapes for negative weights


class ScaledTarget(NamedTuple):
    """A blend shape: the index of its morph target, the factor of the target's offsets, and its weights (F,)."""

    target: int
    factor: float
    weights: Floats


def scale_targets(weights: Floats) -> list[ScaledTarget]:
    """Return blend shapes with the motion of morph targets, and weights in 0 … 1. weights: (F, M).

    A target with weights above 1 is scaled by the largest; one with negative weights becomes two shapes, or one with a
    negative factor. Linear interpolation between frames stays the same, since each weight is a difference of two.
    (weights −1, 3) → factor 3 with weights 0, 1, and factor −1 with weights 1, 0
    """
    found = []
    for i, row in enumerate(weights.T):
        high, low = float(row.max(initial=0.0)), float(row.min(initial=0.0))
        if max(high - 1, -low) <= WEIGHT_TOLERANCE:
            found.append(ScaledTarget(i, 1.0, row))
            continue
        if high > WEIGHT_TOLERANCE or low >= -WEIGHT_TOLERANCE:
            found.append(ScaledTarget(i, max(high, 1.0), np.maximum(row, 0) / max(high, 1.0)))
        if low < -WEIGHT_TOLERANCE:
            found.append(ScaledTarget(i, min(low, -1.0), np.minimum(row, 0) / min(low, -1.0)))
    return found
