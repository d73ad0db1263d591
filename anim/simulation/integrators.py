"""Time integrators of x″ = a(t, x, v), their order, and their stability for the undamped oscillator x″ = −ω²x.

With step h everything depends on ωh: `gain` is the factor by which the amplitude grows in a step, and `limit` the
largest ωh at which it is 1 or less. Source: Hairer, Lubich, Wanner, Geometric Numerical Integration, I.1 and II;
implicit Euler with one Newton step: Baraff, Witkin, Large Steps in Cloth Simulation, 1998.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError
from anim.simulation.limits import MAX_COEFFICIENT, check_range

RADIUS_TOLERANCE = 1e-12
MAX_OMEGA_H = 10.0  # up to which limits with damping are searched
MIN_OMEGA, MAX_OMEGA = 1e-9, 1e9  # rad/s

State: TypeAlias = tuple[Floats, Floats]
Scalar: TypeAlias = Floats | float  # or (P, 1), another for each point
Step: TypeAlias = Callable[["System", Scalar, Floats, Floats, Scalar], State]


class System(Protocol):
    """Second-order system of P points.

    acceleration(time, x, v): (P, 3) m/s², for positions x (P, 3) m and velocities v (P, 3) m/s at `time` s.
    solve_implicit(time, x, v, step): (P, 3) m/s, the change of velocity dv over an implicit Euler step, from
    (I − h ∂a/∂v − h² ∂a/∂x) dv = h (a + h ∂a/∂x v) with the derivatives at the start of the step.
    """

    def acceleration(self, time: Scalar, x: Floats, v: Floats) -> Floats: ...
    def solve_implicit(self, time: Scalar, x: Floats, v: Floats, step: Scalar) -> Floats: ...


@dataclass(frozen=True, slots=True)
class Integrator:
    """One time integrator.

    about: its effect on energy, for `--help`. order: of the error in h, if acceleration depends on position and time
    alone. drag_order: the same if it depends on velocity too: both Verlet forms take drag at an earlier velocity.
    limit: largest stable ωh of the undamped oscillator; 0 if it grows at every step size, infinite if it never does.
    gain: amplitude factor per step, of arrays of ωh. drag_gain: of the velocity of x″ = −r x′, of arrays of rh.
    drag_limit: largest rh at which it is 1 or less.
    step: (system, t, x, v, h) → (x, v) at t + h. staggered: the velocities of the state are those at t − h/2.
    """

    about: str
    order: int
    drag_order: int
    limit: float
    gain: Callable[[Floats], Floats]
    step: Step
    drag_gain: Callable[[Floats], Floats]
    drag_limit: float
    staggered: bool = False

    def start(self, system: System, time: float, x: Floats, v: Floats, step: float) -> State:
        """Return the state that begins at positions x and velocities v."""
        return (x, v - 0.5 * step * system.acceleration(time, x, v)) if self.staggered else (x, v)

    def velocity(self, system: System, time: float, state: State, step: float) -> Floats:
        """Return the velocities of a state at its own time."""
        x, v = state
        return v + 0.5 * step * system.acceleration(time, x, v) if self.staggered else v


def _explicit_euler(system: System, t: Scalar, x: Floats, v: Floats, h: Scalar) -> State:
    return x + h * v, v + h * system.acceleration(t, x, v)


def _symplectic_euler(system: System, t: Scalar, x: Floats, v: Floats, h: Scalar) -> State:
    """Also position Verlet, x₊ = 2x − x₋ + h²a, where v is (x − x₋) / h: the velocity at t − h/2."""
    v = v + h * system.acceleration(t, x, v)
    return x + h * v, v


def _velocity_verlet(system: System, t: Scalar, x: Floats, v: Floats, h: Scalar) -> State:
    half = v + 0.5 * h * system.acceleration(t, x, v)
    x = x + h * half
    return x, half + 0.5 * h * system.acceleration(t + h, x, half)


def _rk4(system: System, t: Scalar, x: Floats, v: Floats, h: Scalar) -> State:
    a1 = system.acceleration(t, x, v)
    v2 = v + 0.5 * h * a1
    a2 = system.acceleration(t + 0.5 * h, x + 0.5 * h * v, v2)
    v3 = v + 0.5 * h * a2
    a3 = system.acceleration(t + 0.5 * h, x + 0.5 * h * v2, v3)
    v4 = v + h * a3
    a4 = system.acceleration(t + h, x + h * v3, v4)
    return x + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def _implicit_euler(system: System, t: Scalar, x: Floats, v: Floats, h: Scalar) -> State:
    v = v + system.solve_implicit(t, x, v, h)
    return x + h * v, v


def _verlet_gain(w: Floats) -> Floats:
    """Gain of the methods with the recurrence x₊ = (2 − w²)x − x₋."""
    half = 0.5 * np.square(w) - 1.0
    return np.where(w <= 2.0, 1.0, half + np.sqrt(np.maximum(half * half - 1.0, 0.0)))


def _rk4_gain(w: Floats) -> Floats:
    return np.hypot(1 - w**2 / 2 + w**4 / 24, w - w**3 / 6)


def _euler_drag_gain(z: Floats) -> Floats:
    return np.abs(1 - z)


def _verlet_drag_gain(z: Floats) -> Floats:
    """Of velocity Verlet, whose half steps both take the velocity that they have."""
    return np.square(1 - 0.5 * z)


def _rk4_drag_gain(z: Floats) -> Floats:
    return np.abs(1 - z + z**2 / 2 - z**3 / 6 + z**4 / 24)


RK4_DRAG_LIMIT = 2.7852935634052816  # root of the polynomial − 1
INTEGRATORS = {
    "explicit-euler": Integrator(
        "gains energy", 1, 1, 0.0, lambda w: np.sqrt(1 + w * w), _explicit_euler, _euler_drag_gain, 2.0
    ),
    "symplectic-euler": Integrator("keeps energy", 1, 1, 2.0, _verlet_gain, _symplectic_euler, _euler_drag_gain, 2.0),
    "verlet": Integrator(
        "keeps energy", 2, 1, 2.0, _verlet_gain, _symplectic_euler, _verlet_drag_gain, 4.0, staggered=True
    ),
    "velocity-verlet": Integrator("keeps energy", 2, 1, 2.0, _verlet_gain, _velocity_verlet, _verlet_drag_gain, 4.0),
    "rk4": Integrator("loses little energy", 4, 4, 2 * np.sqrt(2.0), _rk4_gain, _rk4, _rk4_drag_gain, RK4_DRAG_LIMIT),
    "implicit-euler": Integrator(
        "stable, loses energy",
        1,
        1,
        np.inf,
        lambda w: 1 / np.sqrt(1 + w * w),
        _implicit_euler,
        lambda z: 1 / (1 + z),
        np.inf,
    ),
}


def integrate(system: System, name: str, x: Floats, v: Floats, step: float, num_steps: int) -> Iterator[State]:
    """Yield positions and velocities (P, 3) at times n · step, for n = 0 … num_steps.

    Stops before the first state that is not finite. Raises RangeError for an unknown integrator.
    """
    method = find_integrator(name)
    state = method.start(system, 0.0, x, v, step)
    with np.errstate(all="ignore"):
        for n in range(num_steps + 1):
            if n:
                state = method.step(system, (n - 1) * step, *state, step)
            velocity = method.velocity(system, n * step, state, step)
            if not (np.isfinite(state[0]).all() and np.isfinite(velocity).all()):
                return
            yield state[0], velocity


def find_integrator(name: str) -> Integrator:
    """Return the integrator of this name. Raises RangeError for an unknown one."""
    if name not in INTEGRATORS:
        raise RangeError(f"unknown integrator '{name}' (expected {', '.join(INTEGRATORS)})")
    return INTEGRATORS[name]


@dataclass(frozen=True, slots=True, eq=False)
class DampedOscillator:
    """System x″ = −omega² x − 2 ratio omega x′ of points (P, 3) of 1 kg; omega: rad/s, also (P, 1), as the ratio."""

    omega: Scalar
    ratio: Scalar

    def acceleration(self, time: Scalar, x: Floats, v: Floats) -> Floats:
        """Return the accelerations (P, 3)."""
        return np.asarray(-self.omega * (self.omega * x + 2 * self.ratio * v))

    def solve_implicit(self, time: Scalar, x: Floats, v: Floats, step: Scalar) -> Floats:
        """Return the change of velocity over an implicit Euler step, exactly."""
        under = 1 + step * 2 * self.ratio * self.omega + np.square(step * self.omega)
        return np.asarray(step * (self.acceleration(0.0, x, v) - step * np.square(self.omega) * v) / under)

    def energy(self, x: Floats, v: Floats) -> float:
        """Return kinetic and elastic energy in J."""
        return 0.5 * float(np.square(v).sum() + np.square(self.omega * x).sum())


def oscillator(omega: float, damping_ratio: float = 0.0) -> DampedOscillator:
    """Return an oscillator around the origin of `omega` rad/s, undamped. Raises RangeError.

    A point at the origin stays there: the other end of the spring.
    """
    check_range("omega", omega, MIN_OMEGA, MAX_OMEGA, "rad/s")
    check_range("damping_ratio", damping_ratio, 0.0, MAX_COEFFICIENT)
    return DampedOscillator(omega, damping_ratio)


def damped_limit(name: str, ratio: float) -> float:
    """Return the largest stable ωh of an oscillator with a damping ratio, to 0.1 %.

    Methods that take damping explicitly have a lower limit with it: verlet at a ratio of 0.5 has 1.24, not 2.
    """
    method = find_integrator(name)
    if ratio == 0 or math.isinf(method.limit):
        return method.limit
    low = high = 0.0
    for high in np.geomspace(1e-3, MAX_OMEGA_H, 200).tolist():
        if _spectral_radius(method, ratio, high) > 1 + RADIUS_TOLERANCE:
            break
        low = high
    while high - low > 1e-4 * high:
        middle = (low + high) / 2
        low, high = (middle, high) if _spectral_radius(method, ratio, middle) <= 1 + RADIUS_TOLERANCE else (low, middle)
    return low


def _spectral_radius(method: Integrator, ratio: float, omega_h: float) -> float:
    """Largest factor by which a step of 1 s multiplies a state."""
    x, v = np.array([[1.0, 0, 0], [0.0, 0, 0]]), np.array([[0.0, 0, 0], [1.0, 0, 0]])
    new_x, new_v = method.step(DampedOscillator(omega_h, ratio), 0.0, x, v, 1.0)
    return float(np.abs(np.linalg.eigvals(np.array([new_x[:, 0], new_v[:, 0]]))).max())
