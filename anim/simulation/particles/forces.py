"""Forces on particles: gravity, drag against the air, wind and turbulence of the air."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError
from anim.maths import quaternion
from anim.simulation.limits import (
    MAX_ACCELERATION_M_S2,
    MAX_LENGTH_M,
    MAX_RATE_PER_S,
    MAX_SPEED_M_S,
    MIN_RADIUS_M,
    check_largest,
    check_range,
)
from anim.simulation.particles.attractors import Attractor
from anim.simulation.particles.node_motion import split_frames
from anim.simulation.particles.obstacles import Drive

if TYPE_CHECKING:
    from anim.simulation.particles.kernels.force_field import ForceField

NUM_MODES = 24  # of the turbulence; more are not seen
EARTH_GRAVITY_M_S2 = (0.0, -9.81, 0.0)


@dataclass(frozen=True, slots=True)
class Forces:
    """Accelerations of particles, per mass.

    gravity: m/s². linear_drag: 1/s. quadratic_drag: 1/m; both act on the velocity relative to the air.
    wind: m/s, velocity of the air. turbulence: m/s, root mean square of its random part, which varies over
    turbulence_size m and as it moves that far. seed: of the turbulence.
    Raises RangeError for negative or huge values, or for wind without drag, which moves nothing.
    """

    gravity: tuple[float, float, float] = EARTH_GRAVITY_M_S2
    linear_drag: float = 0.0
    quadratic_drag: float = 0.0
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turbulence: float = 0.0
    turbulence_size: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        check_largest("gravity", self.gravity, MAX_ACCELERATION_M_S2, "m/s²")
        check_largest("wind", self.wind, MAX_SPEED_M_S, "m/s")
        check_range("turbulence", self.turbulence, 0.0, MAX_SPEED_M_S, "m/s")
        check_range("turbulence_size", self.turbulence_size, MIN_RADIUS_M, MAX_LENGTH_M, "m")
        check_range("drag", self.linear_drag, 0.0, MAX_RATE_PER_S, "per second")
        check_range("quadratic_drag", self.quadratic_drag, 0.0, MAX_RATE_PER_S, "per metre")
        if (any(self.wind) or self.turbulence) and not (self.linear_drag or self.quadratic_drag):
            raise RangeError(
                "`wind` and `turbulence` act by drag, and drag is 0", help="give a drag, such as 1 per second"
            )

    @property
    def is_constant(self) -> bool:
        """True if the acceleration of these forces is the same everywhere."""
        return not (self.linear_drag or self.quadratic_drag)

    def drag_rate(self, speed: float) -> float:
        """Return the rate 1/s at which drag slows a particle of this speed: the fastest of the system."""
        return self.linear_drag + 2 * self.quadratic_drag * speed

    def turbulence_modes(self, period: float | None = None) -> tuple[Floats, Floats, Floats, Floats]:
        """Return wave vectors (M, 3) 1/m, amplitudes (M, 3) m/s, angular rates (M,) 1/s, and phases (M,).

        Modes are at right angles to their waves, so that the air has no divergence. Their rates include the wind, which
        takes them along. period: s, after which they repeat: rates are rounded to it.
        Source: Kraichnan, Diffusion by a random velocity field, 1970.
        """
        num = NUM_MODES if self.turbulence else 0
        random = np.random.default_rng([self.seed, NUM_MODES])
        directions = random.standard_normal((NUM_MODES, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        lengths = 2 * np.pi / self.turbulence_size * random.uniform(0.5, 1.5, NUM_MODES)
        across = np.cross(directions, random.standard_normal((NUM_MODES, 3)))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        amplitudes = self.turbulence * np.sqrt(2.0 / NUM_MODES) * across
        waves = directions * lengths[:, None]
        rates = lengths * self.turbulence * random.uniform(-1, 1, NUM_MODES) - waves @ np.asarray(self.wind)
        if period is not None:
            rates = 2 * np.pi / period * np.round(rates * period / (2 * np.pi))
        return waves[:num], amplitudes[:num], rates[:num], random.uniform(0, 2 * np.pi, NUM_MODES)[:num]


def pack_forces(
    forces: Forces, attractors: Sequence[Attractor], step: float, first: int, drive: Drive | None, period: float | None
) -> ForceField:
    """Return all forces for the kernels. step, first: of the times that `drive` places nodes at. period: of a loop."""
    from anim.simulation.particles.kernels.force_field import ForceField, UniformForces

    centers = np.array([[each.center for each in attractors]], np.float64).reshape(1, -1, 3)
    nodes = [k for k, each in enumerate(attractors) if each.node is not None]
    if nodes and drive is not None:
        positions, rotations = split_frames(drive([each.node for each in attractors if each.node is not None]))
        centers = np.repeat(centers, len(positions), axis=0)
        centers[:, nodes] = positions + quaternion.rotate(rotations, centers[:, nodes])
    x, y, z = (float(value) for value in forces.gravity)
    wind = (float(forces.wind[0]), float(forces.wind[1]), float(forces.wind[2]))
    waves, amplitudes, rates, phases = forces.turbulence_modes(period)
    modes = np.ascontiguousarray(np.concatenate([waves, amplitudes, rates[:, None], phases[:, None]], axis=1).T)
    pulls = np.array([[each.strength, each.radius] for each in attractors], np.float64).reshape(-1, 2)
    uniform = UniformForces((x, y, z), float(forces.linear_drag), float(forces.quadratic_drag), wind)
    is_uniform = not forces.turbulence and not attractors
    return ForceField(
        uniform, modes, np.empty(len(phases)), pulls, np.ascontiguousarray(centers), step, first, is_uniform
    )
