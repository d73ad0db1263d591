"""Options of a run of particles."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anim.errors import RangeError
from anim.simulation.limits import MAX_MASS_KG, check_range
from anim.simulation.particles.attractors import Attractor
from anim.simulation.particles.forces import Forces
from anim.simulation.particles.obstacles import Obstacle
from anim.simulation.particles.solver import Contact

SPARK_KG = 1e-3
MIN_SIZE_M, MAX_SIZE_M = 1e-30, 1e30  # of a file's float32


@dataclass(frozen=True, slots=True)
class ParticleOptions:
    """Forces, obstacles and time of a run.

    step: s, the longest; it is shortened so that it divides a frame. loop: begin with the particles that are alive at
    the end; then there is no warm-up. size: m, radius of a particle. mass: kg, of a particle, for energies alone: drag
    is an acceleration. start: s, of the driving clip, the time of the simulation's 0. max_error: m, within which keys
    are removed; 0 for none. estimate_error: simulate a second time with half the step. max_nodes: particles at a time,
    which are as many nodes; None for no limit.
    Raises RangeError for a mass, size or duration that isn't above 0.
    """

    forces: Forces = field(default_factory=Forces)
    obstacles: tuple[Obstacle, ...] = ()
    contact: Contact = field(default_factory=Contact)
    integrator: str = "velocity-verlet"
    step: float = 1 / 240
    fps: float = 60.0
    duration: float = 2.0
    warm_up: float = 0.0
    loop: bool = False
    seed: int = 0
    size: float = 0.01
    start: float = 0.0
    attractors: tuple[Attractor, ...] = ()
    mass: float = SPARK_KG
    max_error: float = 0.0
    estimate_error: bool = True
    max_nodes: int | None = None

    def __post_init__(self) -> None:
        check_range("mass", self.mass, 0.0, MAX_MASS_KG, "kg", is_above=True)
        check_range("size", self.size, MIN_SIZE_M, MAX_SIZE_M, "m")
        for name in ("duration", "fps", "step"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise RangeError(f"`{name}` is {value:g} (expected above 0)")
        if not (np.isfinite(self.max_error) and self.max_error >= 0):
            raise RangeError(f"`max_error` is {self.max_error:g} m (expected at least 0)")
