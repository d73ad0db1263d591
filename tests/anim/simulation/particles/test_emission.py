"""Velocities of emitters: of a smooth motion, and beside jumps of STEP tracks."""

from __future__ import annotations

import numpy as np
import pytest

from anim.errors import DataRangeError
from anim.model import Scene
from anim.simulation.particles.emission import Births, Emitter, emit
from anim.simulation.particles.options import ParticleOptions
from anim.simulation.particles.simulate import simulate_particles
from tests.clips import LINEAR, STEP, clip, skeleton, track


def births(times: list[float], values: list[list[float]], *, is_step: bool) -> Births:
    """Particles at rest on a node below an animated one, one per half a second."""
    played = clip(track("translation", times, np.array(values), STEP if is_step else LINEAR))
    emitter = Emitter((1,), rate=2, speed=0.0, spread=0.0)
    return emit(Scene(skeleton([-1, 0]), ()), played, emitter, 0.0, 1.0, seed=0)


def test_particles_inherit_the_velocity_of_their_emitter() -> None:
    found = births([0, 1], [[0, 0, 0], [3, 0, 4]], is_step=False)
    assert found.velocities == pytest.approx(np.array([[3, 0, 4]] * 2))


@pytest.mark.parametrize("jump", [0.5, 0.5004, 0.4996])
def test_a_jump_is_no_velocity(jump: float) -> None:
    found = births([0, jump], [[0, 0, 0], [1, 0, 0]], is_step=True)
    assert (found.velocities == 0).all()


def test_two_jumps_within_the_interval_are_no_velocity() -> None:
    found = births([0, 0.4996, 0.5004], [[0, 0, 0], [1, 0, 0], [2, 0, 0]], is_step=True)
    assert (found.velocities == 0).all()


def test_an_emitter_faster_than_any_particle_is_refused_whatever_the_step() -> None:
    played = clip(track("translation", [0, 1], np.array([[0.0, 0, 0], [2e5, 0, 0]])))
    scene = Scene(skeleton([-1, 0]), ())
    options = ParticleOptions(duration=0.1)
    with pytest.raises(
        DataRangeError, match="a particle is born at 200000 m/s, mostly the speed of its emitter"
    ) as found:
        simulate_particles(scene, played, Emitter((1,), rate=20, speed=1.0), options)
    assert "lower `inherit`" in found.value.help
    run = simulate_particles(scene, played, Emitter((1,), rate=20, speed=1.0, inherit=0.0), options)
    assert len(run.births) == 2
