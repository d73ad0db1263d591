"""Particles against closed forms: parabolas, bounces, friction, drag; and what is written."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import fixtures
from anim.errors import RangeError, UnstableError
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.model import Clip, Scene
from anim.sampling.track import sample
from anim.simulation.particles import tracks
from anim.simulation.particles.emission import Births, Emitter, emit, repeat_births
from anim.simulation.particles.forces import Forces
from anim.simulation.particles.obstacles import Box, Floor, Obstacle, Sphere
from anim.simulation.particles.simulate import ParticleOptions, add_particles, simulate_particles
from anim.simulation.particles.solver import Contact, ParticleKeys, ParticleSolver
from anim.simulation.steps import Steps
from anim.skinning.bake import bake

Array = NDArray[np.float64]
G = 9.81


def acceleration(forces: Forces, t: float, x: Array, v: Array) -> Array:
    """Acceleration (P, 3) by a plain formula, beside the kernels'."""
    waves, amplitudes, rates, phases = forces.turbulence_modes()
    air = np.asarray(forces.wind) + np.cos(x @ waves.T + rates * t + phases) @ amplitudes
    relative = v - air
    speed = np.linalg.norm(relative, axis=1, keepdims=True)
    result: Array = np.asarray(forces.gravity) - (forces.linear_drag + forces.quadratic_drag * speed) * relative
    return result


def solve(
    position: tuple[float, float, float],
    velocity: tuple[float, float, float],
    *obstacles: Obstacle,
    seconds: float = 2.0,
    step: float = 1 / 240,
    forces: Forces | None = None,
    contact: Contact | None = None,
    integrator: str = "velocity-verlet",
) -> ParticleKeys:
    births = Births(np.zeros(1), np.full(1, 99.0), np.array([position], float), np.array([velocity], float))
    solver = ParticleSolver(births, forces or Forces(), obstacles, contact or Contact(), integrator)
    return solver.run(Steps(step, seconds), max(round(1 / 60 / step), 1))


def test_a_projectile_is_its_parabola_between_two_keys() -> None:
    keys = solve((1, 2, 3), (4, 5, -6), seconds=1.5)
    assert len(keys.times) == 2
    translation, _ = tracks.make_tracks(0, tracks.split_paths(keys), 1.0, 1.5)
    t = np.linspace(0, 1.5, 31)[:, None]
    expected = np.array([1, 2, 3]) + np.array([4, 5, -6]) * t + 0.5 * np.array([0, -G, 0]) * t**2
    np.testing.assert_allclose(sample(translation, t[:, 0]), expected, atol=1e-12)


@pytest.mark.parametrize("step", [1 / 240, 1 / 60])
def test_bounces_keep_the_square_of_the_restitution_of_their_height(step: float) -> None:
    e = 0.8
    keys = solve((0, 1, 0), (0, 0, 0), Floor(0.0), contact=Contact(e), seconds=3.0, step=step)
    hits = np.flatnonzero(keys.in_velocities[:, 1] != keys.out_velocities[:, 1])
    assert len(hits) >= 4
    np.testing.assert_allclose(keys.times[hits[0]], np.sqrt(2 / G), rtol=1e-12)
    apex = keys.out_velocities[hits, 1] ** 2 / (2 * G)
    np.testing.assert_allclose(apex, e ** (2 * np.arange(1, len(hits) + 1)), rtol=1e-9)
    np.testing.assert_allclose(keys.positions[hits, 1], 0.0, atol=1e-12)


def test_friction_stops_a_sliding_particle_after_its_distance() -> None:
    keys = solve((0, 0, 0), (3, -1e-9, 0), Floor(0.0), contact=Contact(0.0, 0.4), seconds=2.0)
    np.testing.assert_allclose(keys.positions[-1], [3**2 / (2 * 0.4 * G), 0, 0], rtol=1e-6, atol=1e-9)
    stop = keys.times[np.flatnonzero((keys.out_velocities == 0).all(axis=1))[0]]
    np.testing.assert_allclose(stop, 3 / (0.4 * G), rtol=1e-6)


def test_a_bouncing_particle_comes_to_rest_on_the_floor_and_stays() -> None:
    keys = solve((0, 1, 0), (1, 0, 0), Floor(0.25), seconds=8.0)
    assert keys.positions[:, 1].min() >= 0.25 - 1e-12
    np.testing.assert_array_equal(keys.in_velocities[-1], 0)
    assert len(keys.times) < 40


def test_a_ball_is_hit_where_the_ray_meets_it() -> None:
    keys = solve((0.3, 3, 0), (0, -1, 0), Sphere((0, 1, 0), 0.5), seconds=1.0)
    height = 1 + np.sqrt(0.5**2 - 0.3**2)
    time = (-1 + np.sqrt(1 + 2 * G * (3 - height))) / G
    np.testing.assert_allclose(keys.positions[1], [0.3, height, 0], atol=1e-9)
    np.testing.assert_allclose(keys.times[1], time, rtol=1e-10)
    normal = np.array([0.3, height - 1, 0]) / 0.5
    v_in, v_out = keys.in_velocities[1], keys.out_velocities[1]
    np.testing.assert_allclose(v_out @ normal, -0.5 * (v_in @ normal), rtol=1e-9)


def test_a_fast_particle_does_not_pass_through_a_small_ball() -> None:
    keys = solve((-1.01, 0, 0), (40, 0, 0), Sphere((0, 0, 0), 0.06), forces=Forces((0, 0, 0)), seconds=0.1)
    assert keys.num_impacts == 1


def test_a_particle_slides_off_the_edge_of_a_box() -> None:
    keys = solve((0, 0.5, 0), (2, -0.01, 0), Box((0, 0, 0), (1, 1, 1)), Floor(-0.5), contact=Contact(0.0, 0.1))
    assert keys.positions[-1, 0] > 0.5
    assert keys.positions[-1, 1] == pytest.approx(-0.5, abs=1e-9)


def test_linear_drag_follows_its_exponential() -> None:
    k, forces = 2.0, Forces(linear_drag=2.0)
    keys = solve((0, 0, 0), (5, 0, 0), forces=forces, integrator="rk4", seconds=1.0)
    np.testing.assert_allclose(keys.in_velocities[:, 0], 5 * np.exp(-k * keys.times), rtol=1e-8)
    np.testing.assert_allclose(keys.in_velocities[:, 1], -G / k * (1 - np.exp(-k * keys.times)), rtol=1e-8, atol=1e-12)


def test_quadratic_drag_ends_at_its_terminal_speed() -> None:
    keys = solve((0, 0, 0), (0, 0, 0), forces=Forces(quadratic_drag=0.5), seconds=5.0)
    np.testing.assert_allclose(keys.in_velocities[-1, 1], -np.sqrt(G / 0.5), rtol=1e-6)


def test_wind_and_turbulence_agree_with_another_integrator() -> None:
    forces = Forces(linear_drag=1.0, quadratic_drag=0.2, wind=(1, 0, 0.5), turbulence=0.8, seed=3)
    keys = solve((0, 1, 0), (0, 2, 0), forces=forces, integrator="rk4", seconds=1.0)

    def slope(t: float, state: Array) -> Array:
        return np.append(state[3:], acceleration(forces, t, state[None, :3], state[None, 3:])[0])

    expected = solve_ivp(slope, (0, 1), [0, 1, 0, 0, 2, 0], rtol=1e-10, atol=1e-12).y[:3, -1]
    np.testing.assert_allclose(keys.positions[-1], expected, atol=1e-7)


def test_turbulence_has_no_divergence_and_the_speed_asked_for() -> None:
    forces = Forces(linear_drag=1.0, turbulence=2.0, turbulence_size=0.3, seed=1)
    x = np.random.default_rng(0).uniform(-9, 9, (4000, 3))
    h = 1e-5

    def flow(p: Array) -> Array:  # of the air: drag is 1/s, and the particles are at rest
        return np.asarray(acceleration(forces, 0.7, p, np.zeros_like(p)) + np.array([0, G, 0]))

    divergence = sum((flow(x + h * e)[:, i] - flow(x - h * e)[:, i]) / (2 * h) for i, e in enumerate(np.eye(3)))
    np.testing.assert_allclose(divergence, 0, atol=1e-6)
    assert np.sqrt(np.square(flow(x)).sum(axis=1).mean()) == pytest.approx(2.0, rel=0.2)


def test_an_implicit_step_solves_its_linear_system() -> None:
    forces = Forces(linear_drag=1.5, quadratic_drag=0.7, wind=(1, 2, 0))
    x, v, h = np.zeros((1, 3)), np.array([[3.0, -2, 1]]), 0.1
    a = acceleration(forces, 0.0, x, v)[0]
    jacobian = np.stack(
        [
            (acceleration(forces, 0.0, x, v + d) - acceleration(forces, 0.0, x, v - d))[0] / 2e-6
            for d in 1e-6 * np.eye(3)
        ],
        1,
    )
    keys = solve((0, 0, 0), (3, -2, 1), forces=forces, integrator="implicit-euler", step=h, seconds=h)
    expected = v[0] + np.linalg.solve(np.eye(3) - h * jacobian, h * a)
    np.testing.assert_allclose(keys.in_velocities[-1], expected, rtol=1e-7)


def test_a_step_beyond_the_limit_is_an_error() -> None:
    with pytest.raises(UnstableError, match="diverges in step"):
        solve(
            (0, 0, 0), (1, 0, 0), forces=Forces(linear_drag=900.0), step=1 / 60, integrator="explicit-euler", seconds=9
        )


@pytest.mark.parametrize("values", [{"linear_drag": -1.0}, {"turbulence_size": 0.0}, {"wind": (1, 0, 0)}])
def test_forces_without_sense_are_refused(values: dict[str, object]) -> None:
    with pytest.raises(RangeError):
        Forces(**values)  # type: ignore[arg-type]


# Emission and output.


def biped() -> tuple[Document, Scene, Clip]:
    document = container.read(np.frombuffer(fixtures.build("biped"), np.uint8))
    return document, reader.scene(document), reader.clips(document)[0]


def test_particles_leave_a_node_within_their_cone() -> None:
    _, scene, clip = biped()
    births = emit(scene, clip, Emitter((5,), rate=200, spread=0.2, inherit=0.0), 0.0, 1.0, seed=4)
    assert len(births) == 200
    speeds = np.linalg.norm(births.velocities, axis=1)
    assert 1.5 <= speeds.min() < speeds.max() <= 2.5
    assert (births.deaths > births.times).all()


def test_particles_leave_a_surface_on_it_along_its_normals() -> None:
    _, scene, _ = biped()
    mesh_node = scene.instances[0].node
    births = emit(scene, Clip("", ()), Emitter((mesh_node,), burst=50, rate=0, surface=True, spread=0.0), 0.0, 1.0, 0)
    rest = next(bake(scene, Clip("", ()), times=np.zeros(1), rigid=True, nodes=[mesh_node]).chunks()).positions[0]
    low, high = rest.min(axis=0) - 1e-6, rest.max(axis=0) + 1e-6
    assert ((births.positions >= low) & (births.positions <= high)).all()


def test_a_loop_begins_with_the_particles_of_its_end() -> None:
    births = Births(np.array([0.1, 0.9]), np.array([2.4, 1.2]), np.zeros((2, 3)), np.array([[0.0, 5, 0], [1, 4, 0]]))
    looped = repeat_births(births, 1.0)
    assert sorted(looped.times) == pytest.approx([-2.9, -2.1, -1.9, -1.1, -0.9, -0.1, 0.1, 0.9])
    keys = ParticleSolver(looped, Forces(), [Floor(-1)], Contact(), "velocity-verlet").run(Steps(1 / 240, 1.0, 3.0), 4)
    ends = {round(t): keys.positions[keys.times == t] for t in (0.0, 1.0)}
    np.testing.assert_allclose(np.sort(ends[0], axis=0), np.sort(ends[1], axis=0), atol=1e-9)


def test_nodes_carry_one_particle_at_a_time() -> None:
    _, scene, clip = biped()
    run = simulate_particles(scene, clip, Emitter((5,), rate=80), ParticleOptions(obstacles=(Floor(),)))
    assert sum(map(len, run.nodes)) == 160
    for paths in run.nodes:
        assert all(a.times[-1] < b.times[0] for a, b in pairwise(paths))
    assert len(run.nodes) < 160
    assert run.report.error_estimate_m is not None
    assert run.report.error_estimate_m < 1e-9


def test_the_written_clip_plays_the_paths_and_the_same_seed_gives_the_same_bytes() -> None:
    document, scene, clip = biped()
    options = ParticleOptions(obstacles=(Floor(),), duration=1.0, seed=7)
    written = []
    for _ in range(2):
        run = simulate_particles(scene, clip, Emitter((5,), rate=40), options)
        written.append(b"".join(bytes(p) for p in container.glb(add_particles(document, run, "sparks"))))
    assert written[0] == written[1]
    read = container.read(np.frombuffer(written[0], np.uint8))
    new = reader.clips(read)[-1]
    path = run.nodes[0][0]
    track = next(each for each in new.tracks if each.path == "translation")
    np.testing.assert_allclose(sample(track, path.times), path.positions, atol=1e-6)
    assert new.end == 1.0


def test_the_error_of_many_particles_is_estimated_from_some(monkeypatch: pytest.MonkeyPatch) -> None:
    _, scene, clip = biped()
    options = ParticleOptions(Forces(linear_drag=2.0, wind=(3, 0, 0)), (Floor(0.0),), duration=1.0)
    reports = []
    for limit in (1000, 10):
        monkeypatch.setattr("anim.simulation.particles.simulate.MAX_ESTIMATED", limit)
        reports.append(simulate_particles(scene, clip, Emitter((3,), rate=60), options).report)
    all_, some = (each.error_estimate_m or 0.0 for each in reports)
    assert 0.1 * all_ < some <= all_
    assert [each.figures["estimated_particles"] for each in reports] == [60, 10]
