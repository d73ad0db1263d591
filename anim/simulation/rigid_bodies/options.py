"""Options of a run of rigid bodies."""

from __future__ import annotations

from dataclasses import dataclass

from anim.simulation.limits import MAX_ACCELERATION_M_S2, check_largest
from anim.simulation.particles.forces import EARTH_GRAVITY_M_S2
from anim.simulation.rigid_bodies.description import Vector

SETTLED_M = 1e-4  # largest distance of a body between both ends of a round that counts as none


@dataclass(frozen=True, slots=True)
class RigidOptions:
    """Gravity and time of a run. step: s, the longest; it is shortened so that it divides a frame.

    max_error: m, of any point of a body's colliders, within which keys are removed; 0 for none.
    loop: repeat the clip until the bodies end as they began; after 20 rounds the last 0.2 s lead back to the start.
    estimate_error: run again with half the step, which takes twice as long. Raises RangeError for a gravity above 1e4.
    """

    gravity: Vector = EARTH_GRAVITY_M_S2
    step: float = 1 / 240
    fps: float = 60.0
    duration: float = 5.0
    warm_up: float = 0.0
    max_error: float = 0.0
    loop: bool = False
    estimate_error: bool = False

    def __post_init__(self) -> None:
        check_largest("gravity", self.gravity, MAX_ACCELERATION_M_S2, "m/s²")
