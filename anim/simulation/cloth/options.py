"""Options of a cloth's simulation."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from anim.sampling.times import check_duration, check_fps
from anim.simulation.cloth.colliders import Obstacle
from anim.simulation.cloth.model import Fabric
from anim.simulation.cloth.solver import Environment
from anim.simulation.limits import MAX_STIFFNESS_N_M, check_range

SOLVERS = {
    "xpbd": "extended position-based dynamics, stiff at any step",
    "mass-spring": "springs, by a time integrator",
    "relaxation": "Verlet with relaxed distances, as stiff as it has iterations",
}

MAX_ITERATIONS = 10_000
FEWER_FRAMES = "choose a lower `fps`, or a shorter `duration`"


@dataclass(frozen=True, slots=True)
class ClothOptions:
    """Fabric, surroundings, solver and time of a cloth.

    solver: a name in SOLVERS. substeps: per frame. iterations: of the constraints per substep, for relaxation.
    max_stretch: doubles the substeps until no edge is longer than this fraction; None for no limit.
    stiffness: N/m, of mass-spring. self_collision, tethers: switches. estimate_error: simulate a second time with half
    the step. duration, warm_up: s, rounded to whole frames. loop: repeat the clip until the motion repeats, and end as
    it begins; frames then divide the duration evenly. Raises RangeError, or UnsupportedError for over ten million
    frames.
    """

    fabric: Fabric = field(default_factory=Fabric)
    environment: Environment = field(default_factory=Environment)
    obstacles: tuple[Obstacle, ...] = ()
    solver: str = "xpbd"
    integrator: str = "velocity-verlet"
    substeps: int = 10
    iterations: int = 20
    max_stretch: float | None = None
    stiffness: float = 500.0
    self_collision: bool = False
    tethers: bool = True
    fps: float = 60.0
    duration: float = 2.0
    warm_up: float = 0.0
    loop: bool = False
    estimate_error: bool = False

    def __post_init__(self) -> None:
        check_fps(self.fps)
        check_range("duration", self.duration, 0.0, math.inf, "s")
        check_duration(0.0, self.duration, fps=self.fps, help=FEWER_FRAMES)
        check_range("iterations", self.iterations, 1, MAX_ITERATIONS)
        check_range("stiffness", self.stiffness, 0.0, MAX_STIFFNESS_N_M, "N/m")

    @property
    def num_frames(self) -> int:
        """Number of frames, both ends included."""
        return round(self.duration * self.fps) + 1
