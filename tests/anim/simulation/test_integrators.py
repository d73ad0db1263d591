"""Integrators against closed forms of the oscillator and the projectile, and the eigenvalues of their own steps."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from anim.errors import RangeError
from anim.simulation.integrators import INTEGRATORS, damped_limit, integrate

Array = NDArray[np.float64]
OMEGA = 2 * np.pi


class Oscillator:
    """x″ = −ω²x − 2ζωx′ + g."""

    def __init__(self, omega: float, damping: float = 0.0, gravity: float = 0.0) -> None:
        self.k, self.c, self.g = omega**2, 2 * damping * omega, gravity

    def acceleration(self, time: Array | float, x: Array, v: Array) -> Array:
        return -self.k * x - self.c * v + self.g

    def solve_implicit(self, time: Array | float, x: Array, v: Array, step: Array | float) -> Array:
        a = self.acceleration(time, x, v)
        return step * (a - step * self.k * v) / (1 + step * self.c + step**2 * self.k)


def run(
    name: str, system: Oscillator, step: float, steps: int, x0: float = 1.0, v0: float = 0.0
) -> tuple[Array, Array]:
    states = list(integrate(system, name, np.array([[x0, 0, 0]]), np.array([[v0, 0, 0]]), step, steps))
    return np.array([x[0, 0] for x, _ in states]), np.array([v[0, 0] for _, v in states])


def energy(x: Array, v: Array) -> Array:
    return 0.5 * v**2 + 0.5 * OMEGA**2 * x**2


def test_energy_of_explicit_euler_is_its_closed_form() -> None:
    step = 1 / 60
    x, v = run("explicit-euler", Oscillator(OMEGA), step, 600)
    expected = energy(x, v)[0] * (1 + (OMEGA * step) ** 2) ** np.arange(601)
    np.testing.assert_allclose(energy(x, v), expected, rtol=1e-9)


def test_symplectic_euler_conserves_its_modified_energy() -> None:
    step = 1 / 60
    x, v = run("symplectic-euler", Oscillator(OMEGA), step, 6000)
    modified = energy(x, v) - 0.5 * OMEGA**2 * step * x * v
    np.testing.assert_allclose(modified, modified[0], rtol=1e-9)


def test_position_and_velocity_verlet_are_one_trajectory_of_the_known_frequency() -> None:
    step = 1 / 60
    x, v = run("verlet", Oscillator(OMEGA), step, 600)
    other, velocity = run("velocity-verlet", Oscillator(OMEGA), step, 600)
    np.testing.assert_allclose(x, other, atol=1e-10)
    np.testing.assert_allclose(v, velocity, atol=1e-9)
    frequency = 2 / step * np.arcsin(OMEGA * step / 2)
    np.testing.assert_allclose(x, np.cos(frequency * step * np.arange(601)), atol=1e-10)
    recurrence = 2 * x[1:-1] - x[:-2] - step**2 * OMEGA**2 * x[1:-1]
    np.testing.assert_allclose(x[2:], recurrence, atol=1e-12)


def test_implicit_euler_loses_energy_by_its_closed_form() -> None:
    step = 1 / 60
    x, v = run("implicit-euler", Oscillator(OMEGA), step, 300)
    expected = energy(x, v)[0] / (1 + (OMEGA * step) ** 2) ** np.arange(301)
    np.testing.assert_allclose(energy(x, v), expected, rtol=1e-9)


@pytest.mark.parametrize("name", INTEGRATORS)
def test_the_gain_is_the_spectral_radius_of_a_step(name: str) -> None:
    method, omega = INTEGRATORS[name], np.linspace(0.05, 3.4, 60)
    for w in omega:
        columns = []
        for x0, v0 in ((1.0, 0.0), (0.0, 1.0)):
            x, v = method.step(Oscillator(w), 0.0, np.array([[x0]]), np.array([[v0]]), 1.0)
            columns.append([x[0, 0], v[0, 0]])
        radius = np.abs(np.linalg.eigvals(np.array(columns).T)).max()
        np.testing.assert_allclose(method.gain(np.array(w)), radius, rtol=1e-6)


@pytest.mark.parametrize("name", [name for name, each in INTEGRATORS.items() if 0 < each.limit < np.inf])
def test_amplitude_stays_below_the_limit_and_grows_above(name: str) -> None:
    limit = INTEGRATORS[name].limit
    below, _ = run(name, Oscillator(1.0), 0.999 * limit, 3000)
    above, _ = run(name, Oscillator(1.0), 1.01 * limit, 3000)
    assert np.abs(below).max() < 100
    assert np.abs(above).max() > 1e6


@pytest.mark.parametrize("damping", [0.0, 0.1])
@pytest.mark.parametrize("name", INTEGRATORS)
def test_the_error_falls_with_the_order(name: str, damping: float) -> None:
    """Verlet is of order 1 where acceleration depends on velocity."""
    omega = np.sqrt(1 + damping**2)
    exact = np.exp(-damping * 2.0) * (np.cos(2.0) + damping * np.sin(2.0))
    errors = []
    for steps in (40, 80, 160):
        x, _ = run(name, Oscillator(omega, damping / omega), 2.0 / steps, steps)
        errors.append(abs(x[-1] - exact))
    slopes = np.diff(np.log2(errors))
    method = INTEGRATORS[name]
    np.testing.assert_allclose(-slopes, method.drag_order if damping else method.order, atol=0.25)


@pytest.mark.parametrize(
    ("name", "excess"),
    [("verlet", 0.0), ("velocity-verlet", 0.0), ("rk4", 0.0), ("symplectic-euler", -0.5), ("explicit-euler", 0.5)],
)
def test_a_projectile_is_exact_or_off_by_half_a_step(name: str, excess: float) -> None:
    step, g = 0.01, -9.81
    x, v = run(name, Oscillator(0.0, gravity=g), step, 100, x0=2.0, v0=5.0)
    t = step * np.arange(101)
    np.testing.assert_allclose(x, 2 + 5 * t + 0.5 * g * t**2 - excess * g * step * t, atol=1e-12)
    np.testing.assert_allclose(v, 5 + g * t, atol=1e-12)


def test_integration_stops_before_values_that_are_not_finite() -> None:
    x, _ = run("explicit-euler", Oscillator(1e6), 1.0, 1000)
    assert 1 < len(x) < 1000
    assert np.isfinite(x).all()


def test_an_unknown_integrator_is_refused() -> None:
    with pytest.raises(RangeError, match="unknown integrator 'euler'"):
        list(integrate(Oscillator(1.0), "euler", np.zeros((1, 3)), np.zeros((1, 3)), 0.1, 1))


@pytest.mark.parametrize("ratio", [0.1, 0.5, 1.0])
def test_limits_with_damping_are_those_of_the_step_matrix(ratio: float) -> None:
    """λ² − (2 − 2ζw − w²) λ + 1 − 2ζw leaves the unit circle at −1: w² + 4ζw = 4; explicit Euler at w = 2ζ."""
    assert damped_limit("verlet", ratio) == pytest.approx(2 * np.sqrt(ratio**2 + 1) - 2 * ratio, rel=1e-3)
    assert damped_limit("explicit-euler", ratio) == pytest.approx(2 * ratio, rel=1e-3)
    assert damped_limit("implicit-euler", ratio) == np.inf
    assert damped_limit("verlet", 0.0) == 2.0
