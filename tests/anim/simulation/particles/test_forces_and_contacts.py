"""Attractors, moving obstacles, curved surfaces and energies, against closed forms and scipy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from anim.errors import RangeError
from anim.model import Clip, Interpolation, Skeleton, Track
from anim.simulation.integrators import INTEGRATORS
from anim.simulation.particles.attractors import Attractor
from anim.simulation.particles.emission import Births
from anim.simulation.particles.forces import Forces
from anim.simulation.particles.key_paths import evaluate_keys, largest_distance, sample_points
from anim.simulation.particles.node_motion import NodeMotion
from anim.simulation.particles.obstacles import Box, Floor, Obstacle, Sphere
from anim.simulation.particles.reduction import reduce_keys
from anim.simulation.particles.solver import Contact, ParticleKeys, ParticleSolver
from anim.simulation.steps import Steps

Array = NDArray[np.float64]
G = 9.81
NO_GRAVITY = Forces((0.0, 0.0, 0.0))
HALF = float(np.sqrt(0.5))


def run(
    positions: list[tuple[float, float, float]],
    velocities: list[tuple[float, float, float]],
    *obstacles: Obstacle,
    seconds: float = 1.0,
    step: float = 1 / 240,
    forces: Forces | None = None,
    contact: Contact | None = None,
    integrator: str = "velocity-verlet",
    attractors: tuple[Attractor, ...] = (),
    motion: NodeMotion | None = None,
) -> ParticleKeys:
    births = Births(
        np.zeros(len(positions)), np.full(len(positions), 99.0), np.array(positions, float), np.array(velocities, float)
    )
    solver = ParticleSolver(births, forces or Forces(), obstacles, contact or Contact(), integrator, attractors, motion)
    return solver.run(Steps(step, seconds), max(1, round(1 / 60 / step)))


def moving_node(values: list[tuple[float, ...]], times: list[float], path: str = "translation") -> NodeMotion:
    track = Track(0, path, Interpolation.LINEAR, np.array(times, float), np.array(values, float))
    return NodeMotion(_skeleton(), Clip("drive", (track,)))


def _skeleton() -> Skeleton:
    return Skeleton(("node",), np.array([-1]), np.zeros((1, 3)), np.array([[0.0, 0, 0, 1]]), np.ones((1, 3)))


def test_inside_an_attractor_a_particle_is_a_harmonic_oscillator() -> None:
    strength, radius = 8.0, 2.0
    keys = run([(1, 0, 0)], [(0, 0, 1)], forces=NO_GRAVITY, attractors=(Attractor(strength, radius),), integrator="rk4")
    omega = np.sqrt(strength / radius)
    t = keys.times
    expected = np.stack([np.cos(omega * t), 0 * t, np.sin(omega * t) / omega], axis=1)
    np.testing.assert_allclose(keys.positions, expected, atol=1e-9)


def test_outside_an_attractor_a_particle_is_on_kepler_s_orbit() -> None:
    strength, radius = 4.0, 0.5
    mu = strength * radius**2
    period = 2 * np.pi / np.sqrt(mu)  # of the circle of 1 m
    keys = run(
        [(1, 0, 0)],
        [(0, 0, np.sqrt(mu))],
        forces=NO_GRAVITY,
        attractors=(Attractor(strength, radius),),
        integrator="rk4",
        seconds=period,
    )
    np.testing.assert_allclose(np.linalg.norm(keys.positions, axis=1), 1.0, atol=1e-8)
    np.testing.assert_allclose(keys.positions[-1], [1, 0, 0], atol=1e-7)
    energy = keys.energies[:, 1:].sum(axis=1)
    np.testing.assert_allclose(energy, 0.5 * mu - mu, rtol=1e-8)


def test_a_moving_attractor_agrees_with_another_integrator() -> None:
    motion = moving_node([(0, 1, 0), (2, 1, 0)], [0, 1])
    keys = run([(0.5, 0, 0)], [(0, 1, 0)], attractors=(Attractor(5.0, 0.3, node=0),), motion=motion, integrator="rk4")

    def slope(t: float, state: Array) -> Array:
        towards = np.array([2 * t, 1, 0]) - state[:3]
        d = np.linalg.norm(towards)
        pull = 5.0 / 0.3 if d <= 0.3 else 5.0 * 0.3**2 / d**3
        return np.append(state[3:], np.array([0, -G, 0]) + pull * towards)

    expected = solve_ivp(slope, (0, 1), [0.5, 0, 0, 0, 1, 0], rtol=1e-10, atol=1e-12).y[:3, -1]
    np.testing.assert_allclose(keys.positions[-1], expected, atol=1e-6)


def test_a_particle_bounces_off_a_rising_box_by_its_relative_speed() -> None:
    e, up = 0.6, 1.5  # the box's top is at −0.5 + 1.5 t
    motion = moving_node([(0, -1, 0), (0, 2, 0)], [0, 2])
    keys = run(
        [(0, 1, 0)], [(0, 0, 0)], Box((0, 0, 0), (4, 1, 4), node=0), motion=motion, contact=Contact(e), seconds=0.6
    )
    time = (-up + np.sqrt(up**2 + 2 * G * 1.5)) / G
    np.testing.assert_allclose(keys.times[1], time, rtol=1e-9)
    np.testing.assert_allclose(keys.in_velocities[1, 1], -G * time, rtol=1e-9)
    np.testing.assert_allclose(keys.out_velocities[1, 1], up + e * (G * time + up), rtol=1e-6)
    np.testing.assert_allclose(keys.positions[1, 1], -0.5 + up * time, rtol=1e-9)
    assert keys.penetration < 1e-9


def test_a_particle_rides_on_a_turning_box() -> None:
    motion = moving_node([(0, 0, 0, 1), (0, HALF, 0, HALF)], [0, 1], "rotation")  # 90° about Y in 1 s
    keys = run(
        [(0.2, 0.5, 0)], [(0, 0, 0)], Box((0, 0, 0), (2, 1, 2), node=0), motion=motion, contact=Contact(0.0, 5.0)
    )
    np.testing.assert_allclose(keys.positions[-1], [0, 0.5, -0.2], atol=2e-3)
    assert keys.penetration < 1e-9


def test_a_small_ball_on_a_fast_node_hits_what_it_passes() -> None:
    motion = moving_node([(-5, 0, 0), (5, 0, 0)], [0, 0.1])  # 100 m/s: 0.4 m in a step
    keys = run([(0, 0, 0)], [(0, 0, 0)], Sphere((0, 0, 0), 0.02, node=0), motion=motion, forces=NO_GRAVITY, seconds=0.1)
    assert keys.num_impacts >= 1
    np.testing.assert_allclose(keys.times[1], (5 - 0.02) / 100, atol=1e-9)
    np.testing.assert_allclose(keys.out_velocities[1], [150, 0, 0], rtol=1e-6, atol=1e-9)


def test_a_particle_slides_off_a_smooth_ball_at_two_thirds_of_its_height() -> None:
    keys = run(
        [(0.01, np.sqrt(1 - 1e-4), 0)],
        [(0, 0, 0)],
        Sphere((0, 0, 0), 1.0),
        contact=Contact(0.0, 0.0),
        step=1 / 4800,
        seconds=2.5,
    )
    distance = np.linalg.norm(keys.positions, axis=1)
    leaves = np.flatnonzero(distance > 1 + 1e-6)[0]
    assert keys.positions[leaves - 1, 1] == pytest.approx(2 / 3, abs=5e-3)
    assert distance.min() > 1 - 1e-9


def test_a_sliding_particle_hits_a_ball_on_its_way() -> None:
    keys = run([(0, 0, 0)], [(3, -1e-9, 0)], Floor(0.0), Sphere((1, 0.1, 0), 0.3), contact=Contact(0.5, 0.0))
    assert keys.positions[:, 0].max() < 1 - np.sqrt(0.3**2 - 0.1**2) + 1e-6
    assert keys.in_velocities[-1, 0] < 0


def test_a_particle_born_inside_an_obstacle_leaves_it_first() -> None:
    keys = run([(0, 1, 0)], [(0, 3, 0)], Sphere((0, 1, 0), 0.2), contact=Contact(1.0), seconds=1.2)
    assert keys.num_inside == 1
    assert keys.positions[:, 1].min() > 1.2 - 1e-6 or keys.num_impacts >= 1
    top = 1 + 9 / (2 * G)
    hit = keys.times[1]
    np.testing.assert_allclose(1 + 3 * hit - 0.5 * G * hit**2, 1.2, atol=1e-9)
    assert top > 1.2


def test_explicit_euler_gains_half_the_square_of_its_velocity_step() -> None:
    h, n = 1 / 240, 240
    keys = run([(0, 2, 0)], [(1, 0, 0)], integrator="explicit-euler")
    gained = np.diff(keys.energies[[0, -1], 1:].sum(axis=1))[0]
    np.testing.assert_allclose(gained, n * 0.5 * (G * h) ** 2, rtol=1e-9)
    exact = run([(0, 2, 0)], [(1, 0, 0)])
    assert abs(exact.drift) < 1e-12
    assert keys.drift > 0


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_orders_of_convergence_under_drag(integrator: str) -> None:
    ends = [
        run(
            [(0, 0, 0)],
            [(3, 2, 0)],
            forces=Forces(quadratic_drag=0.5, wind=(0, 0, 2.0)),
            integrator=integrator,
            step=1 / (60 * n),
        ).positions[-1]
        for n in (1, 2, 4)
    ]
    ratio = np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2])
    assert np.log2(ratio) == pytest.approx(INTEGRATORS[integrator].drag_order, abs=0.15)


@pytest.mark.parametrize("bound", [1e-3, 1e-5])
def test_removed_keys_leave_the_path_within_the_bound(bound: float) -> None:
    random = np.random.default_rng(1)
    births = [tuple(each) for each in random.uniform(0.5, 2, (20, 3))]
    speeds = [tuple(each) for each in random.normal(0, 2, (20, 3))]
    keys = run(births, speeds, Floor(0.0), forces=Forces(linear_drag=1.0, turbulence=1.0), seconds=2.0)
    fewer, error = reduce_keys(keys, bound)
    assert len(fewer.times) < 0.5 * len(keys.times)
    assert 0 < error <= bound
    times = np.tile(np.linspace(0, 2, 2001), 20)
    particles = np.repeat(np.arange(20), 2001)
    a, _, _ = evaluate_keys(keys, particles, times)
    b, _, _ = evaluate_keys(fewer, particles, times)
    measured = np.linalg.norm(a - b, axis=1).max()
    assert 0.3 * bound < measured <= error
    impacts = np.flatnonzero((keys.in_velocities != keys.out_velocities).any(axis=1))
    assert set(keys.times[impacts]) <= set(fewer.times)


def test_a_bound_of_nothing_is_refused() -> None:
    with pytest.raises(RangeError, match="max_error"):
        reduce_keys(run([(0, 0, 0)], [(0, 0, 0)]), 0.0)


def test_parabolas_have_no_keys_to_remove() -> None:
    keys = run([(0, 1, 0)], [(1, 0, 0)], Floor(0.0), seconds=2.0)
    fewer, error = reduce_keys(keys, 1e-6)
    assert len(fewer.times) == len(keys.times)
    assert error == 0.0


def test_half_the_step_changes_the_result_by_less_than_the_estimate() -> None:
    forces = Forces(linear_drag=2.0, wind=(3, 0, 0))
    places, speeds = [(0.0, 1.0, 0.0), (0.2, 1.0, 0.1)], [(1.0, 2.0, 0.0), (0.0, 0.0, 1.0)]
    runs = [run(places, speeds, Floor(0.0), forces=forces, step=1 / (240 * n), seconds=2.0) for n in (1, 2)]
    estimate = largest_distance(runs[0], runs[1])
    times, particles = np.tile(np.arange(121) / 60, 2), np.repeat([0, 1], 121)
    a, b = (evaluate_keys(each, particles, times)[0] for each in runs)
    assert 1e-6 < np.linalg.norm(a - b, axis=1).max() <= estimate


def test_points_live_from_birth_until_before_death() -> None:
    births = Births(np.array([0.0, 0.25]), np.array([0.5, 2.0]), np.array([[0, 0, 0], [1.0, 0, 0]]), np.zeros((2, 3)))
    keys = ParticleSolver(births, NO_GRAVITY, (), Contact(), "rk4").run(Steps(1 / 240, 1.0), 4)
    points = sample_points(keys, births.times, births.deaths, np.arange(9) / 8, size=0.1, start=5.0)
    counts = np.diff(points.offsets)
    np.testing.assert_array_equal(counts, [1, 1, 2, 2, 1, 1, 1, 1, 1])
    np.testing.assert_array_equal(points.ids, [0, 0, 0, 1, 0, 1, 1, 1, 1, 1, 1])
    np.testing.assert_allclose(points.ages, [0, 0.125, 0.25, 0, 0.375, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75])
    np.testing.assert_allclose(points.positions[:, 0], points.ids)
    np.testing.assert_allclose(points.times, 5 + np.arange(9) / 8)
