"""What length a skeleton's unit may be: BVH doesn't say."""

from __future__ import annotations

import math
from typing import NamedTuple

PERSON_HEIGHT_M = 1.7  # m; recorded skeletons are people's more often than not

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
    """Metres per unit, what the unit is called, and the height in metres that the skeleton then has."""

    scale: float
    unit: str
    height: float


def guess_unit(height: float) -> UnitGuess:
    """Return the unit in which a skeleton of this `height` comes nearest to a person's 1.7 m, by ratio.

    guess_unit(172) → 0.01, "centimeters", 1.72
    """
    if height <= 0:
        return UnitGuess(1.0, "meters", 0.0)
    name = min(UNIT_METRES, key=lambda unit: abs(math.log(height * UNIT_METRES[unit] / PERSON_HEIGHT_M)))
    return UnitGuess(UNIT_METRES[name], name, height * UNIT_METRES[name])
