"""Forces on particles: gravity, drag against the air, wind and turbulence of the air."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError

NUM_MODES = 24  # of the turbulence; more are not seen
EARTH_GRAVITY_M_S2 = (0.0, -9.81, 0.0)


@dataclass(frozen=True)
class Forces:
    """Accelerations of particles, per mass.

    gravity: m/s². linear_drag: 1/s. quadratic_drag: 1/m; both act on the velocity relative to the air.
    wind: m/s, velocity of the air. turbulence: m/s, root mean square of its random part, which varies over
    turbulence_size m and as it moves that far. seed: of the turbulence.
    Raises RangeError for negative values, or for wind without drag, which moves nothing.
    """

    gravity: tuple[float, float, float] = EARTH_GRAVITY_M_S2
    linear_drag: float = 0.0
    quadratic_drag: float = 0.0
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turbulence: float = 0.0
    turbulence_size: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("linear_drag", "quadratic_drag", "turbulence", "turbulence_size"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0) or (name == "turbulence_size" and value == 0):
                raise RangeError(f"`{name}` is {value:g} (expected a number of at least 0)")
        if (any(self.wind) or self.turbulence) and not (self.linear_drag or self.quadratic_drag):
            raise RangeError(
                "`wind` and `turbulence` act by drag, and drag is 0", help="give a drag, such as 1 per second"
            )

    @property
    def is_constant(self) -> bool:
        """True if the acceleration is the same everywhere: paths between events are parabolas."""
        return not (self.linear_drag or self.quadratic_drag)

    def acceleration(self, time: Floats | float, x: Floats, v: Floats) -> Floats:
        """Return the acceleration (P, 3) m/s² at `time`, s or (P, 1) s."""
        gravity = np.asarray(self.gravity)
        if self.is_constant:
            return np.broadcast_to(gravity, x.shape)
        relative, factor = self._drag(time, x, v)
        return np.asarray(gravity - factor * relative)

    def solve_implicit(self, time: Floats | float, x: Floats, v: Floats, step: Floats | float) -> Floats:
        """Return the velocity change of an implicit Euler step; the gradient of the turbulence is left out."""
        if self.is_constant:
            return step * self.acceleration(time, x, v)
        relative, factor = self._drag(time, x, v)
        change = step * (np.asarray(self.gravity) - factor * relative)
        speed = np.linalg.norm(relative, axis=1, keepdims=True)
        a, b = 1 + step * factor, step * self.quadratic_drag / np.maximum(speed, 1e-300)  # a I + b r rᵀ
        along = (relative * change).sum(axis=1, keepdims=True)
        return np.asarray((change - relative * (b * along / (a + b * speed**2))) / a)

    def drag_rate(self, speed: float) -> float:
        """Return the rate 1/s at which drag slows a particle of this speed: the fastest of the system."""
        return self.linear_drag + 2 * self.quadratic_drag * speed

    def _drag(self, time: Floats | float, x: Floats, v: Floats) -> tuple[Floats, Floats]:
        """The velocity relative to the air (P, 3), and the drag (P, 1) in 1/s."""
        relative = v - np.asarray(self.wind)
        if self.turbulence:
            relative = relative - self._turbulence(time, x)
        speed = np.linalg.norm(relative, axis=1, keepdims=True)
        return relative, self.linear_drag + self.quadratic_drag * speed

    def _turbulence(self, time: Floats | float, x: Floats) -> Floats:
        """Velocity (P, 3) of random Fourier modes, each at right angles to its wave vector, so free of divergence.

        Source: Kraichnan, Diffusion by a random velocity field, 1970.
        """
        waves, amplitudes, rates, phases = self._modes
        angles = (x - np.asarray(self.wind) * time) @ waves.T + rates * time + phases
        return np.asarray(np.cos(angles) @ amplitudes)

    @cached_property
    def _modes(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Wave vectors (M, 3) 1/m, amplitudes (M, 3) m/s, angular rates (M,) 1/s, and phases (M,)."""
        random = np.random.default_rng([self.seed, NUM_MODES])
        directions = random.standard_normal((NUM_MODES, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        lengths = 2 * np.pi / self.turbulence_size * random.uniform(0.5, 1.5, NUM_MODES)
        across = np.cross(directions, random.standard_normal((NUM_MODES, 3)))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        amplitudes = self.turbulence * np.sqrt(2.0 / NUM_MODES) * across
        rates = lengths * self.turbulence * random.uniform(-1, 1, NUM_MODES)
        return directions * lengths[:, None], amplitudes, rates, random.uniform(0, 2 * np.pi, NUM_MODES)
