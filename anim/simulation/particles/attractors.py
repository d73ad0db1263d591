"""Attractors: nodes or points that pull particles like the gravity of a ball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.simulation.limits import (
    MAX_ACCELERATION_M_S2,
    MAX_LENGTH_M,
    MIN_RADIUS_M,
    check_largest,
    check_range,
)


@dataclass(frozen=True, slots=True)
class Attractor:
    """Ball of uniform density around a node's origin, or around `center` (3,) m.

    strength: m/s² on its surface, below 0 to push away; it grows linearly inside and falls with the squared distance
    outside. radius: m, > 0. center: in the space of `node`, or of the scene for None. Raises RangeError.
    """

    strength: float
    radius: float
    node: int | None = None
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        check_range("radius", self.radius, MIN_RADIUS_M, MAX_LENGTH_M, "m")
        check_range("strength", self.strength, -MAX_ACCELERATION_M_S2, MAX_ACCELERATION_M_S2, "m/s²")
        check_largest("center", self.center, MAX_LENGTH_M, "m")

    @property
    def max_frequency(self) -> float:
        """Largest angular frequency in rad/s of a particle around it: inside."""
        return float(np.sqrt(max(self.strength, 0.0) / self.radius))
