"""Guess the unit of length of a skeleton, which BVH does not state."""

from __future__ import annotations

import math
from typing import NamedTuple

PERSON_HEIGHT_M = 1.7  # most recorded skeletons are human

# m. CMU's skeletons are in inches × 0.45 (asfmt "length 0.45" of the ASF files).
UNIT_METRES = {
    "meters": 1.0,
    "decimeters": 0.1,
    "feet": 0.3048,
    "inches": 0.0254,
    "centimeters": 0.01,
    "millimeters": 0.001,
    "CMU's unit of 1/0.45 inch": 0.0254 / 0.45,
}


class UnitGuess(NamedTuple):
    """Metres per unit, name of the unit, and the resulting height of the skeleton in metres."""

    scale: float
    unit: str
    height: float


def guess_unit(height: float) -> UnitGuess:
    """Return the unit that gives a skeleton of this `height` the ratio nearest to a height of 1.7 m.

    guess_unit(172) → 0.01, "centimeters", 1.72
    """
    if height <= 0:
        return UnitGuess(1.0, "meters", 0.0)
    name = min(UNIT_METRES, key=lambda unit: abs(math.log(height * UNIT_METRES[unit] / PERSON_HEIGHT_M)))
    return UnitGuess(UNIT_METRES[name], name, height * UNIT_METRES[name])
