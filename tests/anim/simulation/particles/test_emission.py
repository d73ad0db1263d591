"""Births: their number, before any work; velocities of emitters, also beside jumps of STEP tracks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

import fixtures
from anim.arrays import Floats
from anim.errors import DataRangeError, RangeError, UnsupportedError
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.model import Scene, VertexCache
from anim.simulation.particles import emitter_motion
from anim.simulation.particles.emission import BirthPlan, Births, Emitter, emit, plan_births, repeat_births
from anim.simulation.particles.node_motion import NodeMotion
from anim.simulation.particles.options import ParticleOptions
from anim.simulation.particles.simulate import simulate_particles
from anim.skinning.bake import bake
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


def plan(emitter: Emitter, end: float) -> BirthPlan:
    """Births from 0 s on."""
    return plan_births(emitter, 0.0, end, seed=3)


@pytest.mark.parametrize("is_loop", [False, True])
@pytest.mark.parametrize(("rate", "burst", "lifetime"), [(40.0, 0, 0.3), (0.0, 9, 5.0), (25.0, 3, 2.7)])
def test_particles_at_a_time_are_counted_before_they_are_placed(
    rate: float, burst: int, lifetime: float, is_loop: bool
) -> None:
    emitter = Emitter((0, 1, 2), rate=rate, burst=burst, lifetime=lifetime)
    births = emit(Scene(skeleton([-1, 0, 1]), ()), clip(), emitter, 0.0, 2.0, seed=3)
    if is_loop:
        births = repeat_births(births, 2.0)
    times = np.linspace(0, 2, 4001)[:, None]
    alive = ((births.times <= times) & (times < births.deaths)).sum(axis=1)
    assert plan(emitter, 2.0).count_simultaneous(2.0, is_loop=is_loop) == alive.max()


def test_more_particles_at_a_time_than_nodes_are_refused_before_any_pose(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise AssertionError("the motion is evaluated")

    monkeypatch.setattr("anim.simulation.particles.simulate.place_births", fail)
    with pytest.raises(UnsupportedError, match=r"^\d+ particles at a time \(limit 100 nodes\)$"):
        simulate_particles(
            Scene(skeleton([-1, 0]), ()), clip(), Emitter((0, 1), rate=1e3), ParticleOptions(max_nodes=100)
        )


def test_a_loop_of_long_lives_is_refused_before_it_is_repeated() -> None:
    births = emit(Scene(skeleton([-1]), ()), clip(), Emitter((0,), lifetime=1e8), 0.0, 1.0, seed=0)
    with pytest.raises(UnsupportedError, match=r"particles \(limit 1000000\)"):
        repeat_births(births, 1.0)


def test_poses_are_evaluated_once_for_all_emitters(monkeypatch: pytest.MonkeyPatch) -> None:
    evaluated: list[int] = []

    class Counted(NodeMotion):
        def at(self, times: Floats, nodes: Sequence[int]) -> Floats:
            evaluated.append(len(times))
            return super().at(times, nodes)

    monkeypatch.setattr(emitter_motion, "NodeMotion", Counted)
    scene, played = Scene(skeleton([-1, *range(39)]), ()), clip(track("rotation", [0, 1], [[0, 0, 0, 1], [1, 0, 0, 0]]))
    together = emit(scene, played, Emitter(tuple(range(40))), 0.0, 0.5, seed=7)
    assert evaluated == [3 * 25 - 1]  # before and at the first birth is the same pose
    monkeypatch.setattr(emitter_motion, "MAX_MATRICES", 500)
    apart = emit(scene, played, Emitter(tuple(range(40))), 0.0, 0.5, seed=7)
    assert len(evaluated) > 2
    for node in (0, 17, 39):
        alone = emit(scene, played, Emitter((node,)), 0.0, 0.5, seed=7)
        for every in (together, apart):
            for name in ("times", "deaths", "positions", "velocities"):
                assert (getattr(every, name)[node::40] == getattr(alone, name)).all(), (name, node)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"burst": 10**20}, r"`burst` is 1e\+20 \(expected 0 to 1e\+15\)"),
        ({"rate": 1e308}, r"`rate` is 1e\+308 per second \(expected 0 to 1e\+15\)"),
        ({"lifetime": 1e308}, r"`lifetime` is 1e\+308 s \(expected 0.001 to 1e\+09\)"),
        ({"lifetime": float("nan")}, "`lifetime` is nan s"),
        ({"speed": -1.0}, r"`speed` is -1 m/s \(expected 0 to 10000\)"),
    ],
)
def test_emitters_beyond_their_limits_are_refused(change: dict[str, float], words: str) -> None:
    with pytest.raises(RangeError, match=words):
        Emitter((0,), **change)  # type: ignore[arg-type]


def test_surfaces_are_baked_once_for_all_emitters(monkeypatch: pytest.MonkeyPatch) -> None:
    baked: list[object] = []

    def counted(*args: object, **options: object) -> VertexCache:
        baked.append(options["nodes"])
        return bake(*args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(emitter_motion, "bake", counted)
    document = container.read(fixtures.build("wall"))
    scene = reader.scene(document)
    nodes = tuple(sorted({each.node for each in scene.instances})[:5])
    assert len(nodes) == 5
    played = clip(track("translation", [0, 1], [[0, 0, 0], [1, 2, 3]], node=nodes[1]))
    together = emit(scene, played, Emitter(nodes, surface=True), 0.0, 0.5, seed=7)
    assert baked == [list(nodes)]
    for row, node in enumerate(nodes):
        alone = emit(scene, played, Emitter((node,), surface=True), 0.0, 0.5, seed=7)
        for name in ("times", "deaths", "positions", "velocities"):
            assert (getattr(together, name)[row :: len(nodes)] == getattr(alone, name)).all(), (name, node)
