"""Masses and springs against closed forms and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from anim.errors import RangeError
from anim.simulation.comparison import compare_integrators
from anim.simulation.integrators import INTEGRATORS, integrate, oscillator
from anim.simulation.mass_spring import MassSpring

Array = NDArray[np.float64]
G = 9.81


def rope(num_points: int, length: float, mass: float, stiffness: float, angle: float) -> tuple[MassSpring, Array]:
    """A rope of points pinned at its first, and its straight start (P, 3) at `angle` rad from hanging down.

    length: m, mass: kg, of all. stiffness: N/m, of each spring between neighbors.
    """
    at = np.linspace(0, length, num_points)
    x = np.stack([at * np.sin(angle), -at * np.cos(angle), np.zeros(num_points)], axis=1)
    masses = np.full(num_points, mass / num_points)
    masses[0] = np.inf
    springs = np.stack([np.arange(num_points - 1), np.arange(1, num_points)], axis=1)
    count = num_points - 1
    return MassSpring(masses, springs, np.full(count, length / count), np.full(count, stiffness), np.zeros(count)), x


def net(seed: int, damping: float = 0.3) -> tuple[MassSpring, Array, Array]:
    """A random net of six points, the first pinned, all springs under tension."""
    random = np.random.default_rng(seed)
    masses = random.uniform(0.5, 2, 6)
    masses[0] = np.inf
    springs = np.array([[a, b] for a in range(6) for b in range(a)])
    x = random.standard_normal((6, 3))
    lengths = 0.8 * np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=1)
    count = len(springs)
    system = MassSpring(masses, springs, lengths, random.uniform(5, 50, count), np.full(count, damping), drag=0.2)
    return system, x, random.standard_normal((6, 3)) * (np.isfinite(masses)[:, None])


def test_forces_are_the_gradient_of_the_energy() -> None:
    system, x, v = net(1, damping=0.0)
    still = np.zeros_like(v)
    gradient = np.zeros_like(x)
    for index in np.ndindex(*x.shape):
        step = np.zeros_like(x)
        step[index] = 1e-6
        gradient[index] = (system.energy(x + step, still) - system.energy(x - step, still)) / 2e-6
    free = system.is_free
    expected = -gradient[free] / system.masses[free, None]
    np.testing.assert_allclose(system.acceleration(0.0, x, still)[free], expected, rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(system.acceleration(0.0, x, v)[0], 0)


def test_an_implicit_step_solves_the_linear_system_of_finite_differences() -> None:
    system, x, v = net(2)
    h, free = 0.05, np.flatnonzero(np.repeat(system.is_free, 3))
    size = x.size

    def a(x: Array, v: Array) -> Array:
        return system.acceleration(0.0, x.reshape(-1, 3), v.reshape(-1, 3)).ravel()

    def jacobian(of_x: bool) -> Array:
        columns = []
        for i in range(size):
            d = np.zeros(size)
            d[i] = 1e-6
            ends = (a(x.ravel() + s * d, v.ravel()) if of_x else a(x.ravel(), v.ravel() + s * d) for s in (1, -1))
            columns.append((next(ends) - next(ends)) / 2e-6)
        return np.stack(columns, 1)

    # With x, damping forces change direction too, which the method leaves out: compare without it.
    undamped = MassSpring(system.masses, system.springs, system.rest_lengths, system.stiffness, 0 * system.damping)
    dv = undamped.solve_implicit(0.0, x, v, h).ravel()
    system = undamped
    dx, dv_dv = jacobian(True), jacobian(False)
    matrix = np.eye(size) - h * dv_dv - h * h * dx
    right = h * (a(x.ravel(), v.ravel()) + h * dx @ v.ravel())
    expected = np.zeros(size)
    expected[free] = np.linalg.solve(matrix[np.ix_(free, free)], right[free])
    np.testing.assert_allclose(dv, expected, rtol=1e-5, atol=1e-6)


def test_momentum_is_kept_without_outer_forces() -> None:
    system, x, v = net(3)
    loose = MassSpring(
        np.full(6, 0.7), system.springs, system.rest_lengths, system.stiffness, system.damping, (0, 0, 0)
    )
    for name in INTEGRATORS:
        *_, (end, velocity) = integrate(loose, name, x, v, 1e-3, 300)
        np.testing.assert_allclose(velocity.sum(axis=0), v.sum(axis=0), atol=1e-8)
        if name in ("symplectic-euler", "verlet", "velocity-verlet"):
            np.testing.assert_allclose(np.cross(end, velocity).sum(axis=0), np.cross(x, v).sum(axis=0), atol=2e-3)


def test_two_masses_swing_at_their_frequency() -> None:
    k, m = 80.0, np.array([1.0, 3.0])
    pair = MassSpring(m, np.array([[0, 1]]), np.ones(1), np.array([k]), np.zeros(1), (0.0, 0.0, 0.0))
    omega = np.sqrt(k * (1 / m).sum())
    states = list(integrate(pair, "rk4", np.array([[0, 0, 0], [1.1, 0, 0]]), np.zeros((2, 3)), 1e-3, 2000))
    gap = np.array([x[1, 0] - x[0, 0] for x, _ in states])
    np.testing.assert_allclose(gap, 1 + 0.1 * np.cos(omega * 1e-3 * np.arange(2001)), atol=1e-6)


def test_a_hanging_rope_is_stretched_by_the_weight_below() -> None:
    system, x = rope(8, 1.4, 0.8, 200.0, 0.0)
    damped = MassSpring(system.masses, system.springs, system.rest_lengths, system.stiffness, np.full(7, 5.0), drag=2.0)
    *_, (end, _) = integrate(damped, "implicit-euler", x, np.zeros_like(x), 0.1, 600)
    expected = 0.1 * G * np.arange(7, 0, -1) / 200.0 / 0.2
    np.testing.assert_allclose(damped.elongation(end), expected, rtol=1e-5)


def test_the_bound_of_frequencies_holds_and_is_near_for_a_rope() -> None:
    system, _ = rope(30, 3.0, 3.0, 500.0, 0.0)
    matrix = np.zeros((30, 30))
    for a, b in system.springs:
        for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
            matrix[i, j] += sign * 500.0 / 0.1
    largest = np.sqrt(np.linalg.eigvalsh(matrix[1:, 1:]).max())
    assert largest <= system.max_frequency() <= 1.01 * largest


def mass_on_spring(omega: float) -> MassSpring:
    """1 kg on a spring of length 0 from a pinned point: an oscillator."""
    spring = np.array([[0, 1]])
    stiffness = np.array([omega**2])
    masses = np.array([np.inf, 1.0])
    return MassSpring(masses, spring, np.zeros(1), stiffness, np.zeros(1), gravity=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("omega_h", [0.3, 1.9])
def test_a_mass_on_a_spring_is_an_oscillator_by_every_integrator(omega_h: float) -> None:
    x = np.array([[0.0, 0, 0], [1, 0, 0]])
    runs, expected = (
        compare_integrators(system, x, np.zeros_like(x), step=omega_h / 10, duration=3.0)
        for system in (mass_on_spring(10.0), oscillator(10.0))
    )
    for run, other in zip(runs, expected, strict=True):
        np.testing.assert_allclose(run.positions, other.positions, rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(run.energies, other.energies, rtol=1e-6)


@pytest.mark.parametrize("omega_h", [1.9, 2.1, 2.7])
def test_the_comparison_tells_who_diverges(omega_h: float) -> None:
    system = mass_on_spring(10.0)
    x = np.array([[0.0, 0, 0], [1, 0, 0]])
    runs = compare_integrators(system, x, np.zeros_like(x), step=omega_h / 10, duration=60.0)
    gone = {run.name for run in runs if run.diverged_at is not None}
    assert gone == {name for name, each in INTEGRATORS.items() if omega_h > each.limit}
    for run in runs:
        assert np.isfinite(run.positions).all()
        assert len(run.times) == len(run.energies) == len(run.positions)


@pytest.mark.parametrize("values", [(0.0, 0.0), (-1.0, 0.0), (1.0, -0.1), (np.nan, 0.0), (1e308, 0.0)])
def test_oscillators_without_sense_are_refused(values: tuple[float, float]) -> None:
    with pytest.raises(RangeError):
        oscillator(*values)


def test_a_negative_mass_is_refused() -> None:
    with pytest.raises(RangeError, match="mass"):
        MassSpring(np.array([1.0, -1]), np.array([[0, 1]]), np.ones(1), np.ones(1), np.ones(1))
