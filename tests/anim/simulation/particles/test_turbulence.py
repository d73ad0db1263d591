"""Turbulence of the kernels: no divergence, its cosine, and particles that rest in it."""

from __future__ import annotations

import numpy as np
import pytest

from anim.simulation.particles.forces import Forces, pack_forces
from anim.simulation.particles.kernels.force_field import air_velocity
from anim.simulation.particles.kernels.turbulence import cosine
from anim.simulation.particles.obstacles import Floor
from tests.anim.simulation.particles.test_particles import solve

WIND = (1.0, 0.0, -2.0)


def test_the_kernels_air_has_no_divergence_and_the_speed_asked_for() -> None:
    forces = Forces(linear_drag=1.0, wind=WIND, turbulence=2.0, turbulence_size=0.3, seed=1)
    field = pack_forces(forces, (), 1 / 240, 0, None, None)
    points, h = np.random.default_rng(0).uniform(-9, 9, (500, 3)), 1e-5

    def flow(at: np.ndarray) -> np.ndarray:
        return np.array([air_velocity(field, 0.7, tuple(each)) for each in at])

    slopes = [(flow(points + h * e) - flow(points - h * e)) / (2 * h) for e in np.eye(3)]
    divergence = sum(slope[:, axis] for axis, slope in enumerate(slopes))
    np.testing.assert_allclose(divergence, 0, atol=1e-4)
    assert np.abs(slopes).max() > 5
    speed = np.sqrt(np.square(flow(points) - WIND).sum(axis=1).mean())
    assert speed == pytest.approx(2.0, rel=0.2)


def test_the_cosine_is_that_of_the_library() -> None:
    x = np.concatenate([np.linspace(-1e4, 1e4, 4001), np.arange(-20, 20) * np.pi / 2])
    np.testing.assert_allclose([cosine(each) for each in x], np.cos(x), atol=1e-10)


def test_a_particle_that_grips_the_floor_has_no_keys_until_the_air_moves_it() -> None:
    """Slow air leaves it where it is; fast air carries it away at last."""
    slow = solve((0, 0.2, 0), (0, 0, 0), Floor(), forces=Forces(linear_drag=0.5, turbulence=0.2), seconds=3.0)
    rests = slow.times > 2
    assert rests.sum() <= 2
    np.testing.assert_array_equal(slow.out_velocities[rests], 0)
    fast = solve((0, 0.2, 0), (0, 0, 0), Floor(), forces=Forces(linear_drag=5.0, turbulence=2.0), seconds=3.0)
    assert np.linalg.norm(fast.positions[-1, [0, 2]]) > 0.1
