"""What is written: tracks in node space, driven colliders, sleeping bodies, reduction, notes, divergence."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain, repeat
from typing import Any

import numpy as np
import pytest

import fixtures
from anim.errors import RangeError, UnstableError
from anim.gltf.authoring import add_clips
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.model import Clip, Interpolation, TimeAxis, Track
from anim.sampling.sample import sample
from anim.sampling.track import sample as sample_track
from anim.simulation.rigid_bodies.description import Material, Shape
from anim.simulation.rigid_bodies.node_globs import ChosenNodes, add_chosen
from anim.simulation.rigid_bodies.options import RigidOptions
from anim.simulation.rigid_bodies.rapier.world import RapierWorld
from anim.simulation.rigid_bodies.simulate import (
    add_rigid_motion,
    read_description,
    simulate_rigid_bodies,
)
from tests.anim.simulation.rigid_bodies.cases import NO_CLIP, G, collider, document, needs_rapier, node, path, simulate
from tests.files import glb_of, opened, opened_fixture

pytestmark = needs_rapier
BALL: list[dict[str, Any]] = [{"type": "sphere", "sphere": {"radius": 0.5}}, {"type": "plane"}]
FALLING: dict[str, Any] = {"motion": {}, "collider": collider(0)}


def with_clip(made: Document, *tracks: Track) -> Document:
    return add_clips(made, [Clip("drive", tracks)])


def test_tracks_are_in_the_space_of_a_turned_and_scaled_parent() -> None:
    s = float(np.sqrt(0.5))
    parent = {"translation": [5, 1, 0], "rotation": [0, 0, s, s], "scale": [2, 2, 2], "children": [1]}
    made = document([parent, node((0, 0, 0), motion={}, collider=collider(0))], BALL)
    run = simulate(made, duration=1.0)
    table = sample(reader.skeleton(made), Clip("", tuple(run.tracks)), np.array([0.0, 1.0]), space="world")
    np.testing.assert_allclose(table.translation[:, 1], np.array([[5, 1, 0], [5, 1 - G / 2, 0]]), atol=1e-3)
    np.testing.assert_allclose(path(run, 1)[-1], [-G / 4, 0, 0], atol=1e-3)
    assert {track.path for track in run.tracks} == {"translation", "rotation"}


def test_tracks_are_relative_to_an_animated_parent() -> None:
    made = with_clip(
        document([{"children": [1]}, node((0, 3, 0), **FALLING)], BALL),
        Track(0, "translation", Interpolation.LINEAR, [0.0, 1.0], [[0, 0, 0], [4, 0, 0]]),
    )
    run = simulate(made, duration=1.0)
    np.testing.assert_allclose(path(run, 1)[-1], [-4, 3 - G / 2, 0], atol=1e-3)
    assert run.notes == ["a parent of node 1 is animated: play its clip too, or merge both"]


@pytest.mark.parametrize(("interpolation", "noted"), [(Interpolation.STEP, 1), (Interpolation.LINEAR, 0)])
def test_a_collider_that_jumps_is_noted(interpolation: Interpolation, noted: int) -> None:
    made = with_clip(
        document([node((0, 0, 0), collider=collider(0)), node((0, 9, 0), **FALLING)], BALL),
        Track(0, "translation", interpolation, [0.0, 0.25, 0.5], np.outer([0, 0, 0.75], [0, 1, 0])),
    )
    jumps = [each for each in simulate(made, duration=0.75).notes if "jumps by 0.75 m at 0.5 s (STEP keys)" in each]
    assert len(jumps) == noted


def test_a_body_below_a_body_is_its_own() -> None:
    made = document(
        [
            node((0, 1, 0), motion={}, collider=collider(0), children=[1]),
            node((3, 2, 0), **FALLING),
            node(collider=collider(1)),
        ],
        BALL,
    )
    run = simulate(made, duration=2.0)
    table = sample(reader.skeleton(made), Clip("", tuple(run.tracks)), np.array([2.0]), space="world")
    np.testing.assert_allclose(table.translation[0, :2], [[0, 0.5, 0], [3, 0.5, 0]], atol=0.02)


def test_an_animated_collider_lifts_a_body_at_every_step() -> None:
    times = np.linspace(0, 2, 9)
    lift = np.stack([0 * times, 1 - np.cos(np.pi * times / 2), 0 * times], axis=1)
    made = with_clip(
        document(
            [node((0, -0.5, 0), children=[1]), node(collider=collider(2)), node((0, 0.5, 0), **FALLING)],
            [*BALL, {"type": "box", "box": {"size": [4, 1, 4]}}],
        ),
        Track(0, "translation", Interpolation.LINEAR, times, lift - (0, 0.5, 0)),
    )
    run = simulate(made, duration=2.0)
    assert path(run, 2)[-1, 1] == pytest.approx(2 + 0.5, abs=0.03)
    assert run.report.figures["animated"] == 1


def test_a_motion_whose_node_is_animated_follows_the_clip() -> None:
    made = with_clip(
        document([node((0, 5, 0), **FALLING), node((3, 5, 0), **FALLING)], BALL),
        Track(0, "translation", Interpolation.LINEAR, [0.0, 1.0], [[0, 5, 0], [1, 5, 0]]),
    )
    run = simulate(made, duration=1.0)
    assert {track.node for track in run.tracks} == {1}


def test_a_sleeping_body_has_no_keys_but_its_last() -> None:
    made = document([node((0, 1, 0), **FALLING), node(collider=collider(1))], BALL)
    run = simulate(made, duration=10.0)
    times = run.tracks[0].times
    assert times[-1] == 10.0
    assert times[-1] - times[-2] > 5
    np.testing.assert_array_equal(run.tracks[0].values[-1], run.tracks[0].values[-2])
    assert run.report.figures["at_rest"] == 1
    assert len(run.report.energy_j or {}) == 3


def test_impacts_are_keys_between_frames() -> None:
    made = document([node((0, 1.5, 0), **FALLING), node(collider=collider(1))], BALL)
    times = simulate(made, duration=1.0).tracks[0].times
    between = times[np.abs(times * 60 - np.round(times * 60)) > 1e-3]
    np.testing.assert_allclose(between, [np.sqrt(2 / G)], atol=1e-5)


@pytest.mark.parametrize("max_error", [1e-4, 1e-2])
def test_reduction_stays_within_its_bound(max_error: float) -> None:
    boxes = [
        node((0.2 * i, 0.6 + 1.1 * i, 0.1 * i), motion={"angularVelocity": [1, 2, 3]}, collider=collider(2))
        for i in range(4)
    ]
    made = document([*boxes, node(collider=collider(1))], [*BALL, {"type": "box"}])
    full, less = (simulate(made, duration=3.0, max_error=each) for each in (0.0, max_error))
    assert less.report.figures["keys"] < 0.95 * full.report.figures["keys"]
    at = full.tracks[0].times
    reach = np.sqrt(3) / 2
    for i in range(4):
        first, second = ([sample_track(track, at) for track in run.tracks if track.node == i] for run in (full, less))
        angle = quaternion.angle_between(first[1], second[1])
        error = np.linalg.norm(first[0] - second[0], axis=1) + 2 * reach * np.sin(angle / 2)
        assert error.max() <= 1.001 * max_error


def test_a_body_inside_another_is_noted() -> None:
    made = document([node((0, 0.3, 0), **FALLING), node(collider=collider(1))], BALL)
    assert simulate(made, duration=0.2).notes == ["node 0 and node 1 overlap by 20 cm at the start"]


def test_an_endless_plane_supports_hulls_far_from_its_node() -> None:
    made = document(
        [
            node((0, 0, 0), motion={}, collider={"geometry": {"shape": 0}}),
            node((9000, -1, -4000), collider=collider(1)),
        ],
        [{"type": "box"}, {"type": "plane"}],
    )
    scene = reader.scene(made)
    description = read_description(made, scene.skeleton)
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    hull = {0: replace(description.colliders[0], shape=Shape("hull", points=corners)), 1: description.colliders[1]}
    run = simulate_rigid_bodies(scene, NO_CLIP, replace(description, colliders=hull), RigidOptions(duration=2.0))
    np.testing.assert_allclose(path(run, 0)[-1], [0, -0.5, 0], atol=0.01)


def test_a_state_that_is_not_finite_ends_the_run() -> None:
    made = document([node(motion={"angularVelocity": [1e30, 0, 0]}, collider=collider(0))], BALL)
    with pytest.raises(UnstableError, match="diverges in step"):
        simulate(made, duration=1.0)


def test_a_run_that_diverges_has_a_report() -> None:
    made = document([node(motion={"angularVelocity": [1e30, 0, 0]}, collider=collider(0))], BALL)
    with pytest.raises(UnstableError) as error:
        simulate(made, duration=1.0)
    report = error.value.report
    assert (report.kind, report.first_bad_step) == ("rigid", 1)
    assert report.advice.endswith("--step 1/480")


def test_a_run_whose_half_step_diverges_has_the_report_of_that(monkeypatch: pytest.MonkeyPatch) -> None:
    failures = chain(repeat(False, 6), repeat(True))
    monkeypatch.setattr(RapierWorld, "has_failed", lambda _: next(failures))
    made = document([node((0, 1, 0), **FALLING)], BALL)
    with pytest.raises(UnstableError, match="diverges in step 1") as error:
        simulate(made, duration=0.1, step=1 / 60, estimate_error=True)
    report = error.value.report
    assert (report.step_s, report.first_bad_step) == (1 / 120, 1)
    assert report.advice.endswith("--step 1/240")


def test_the_report_states_energy_drift_and_the_error_of_the_step() -> None:
    made = document([node((0, 1, 0), **FALLING), node(collider=collider(1))], BALL)
    report = simulate(made, duration=1.0, estimate_error=True).report
    assert report.energy_j is not None
    assert report.drift_per_s == pytest.approx(-1, abs=0.05)  # it falls and stays
    assert report.history is not None
    assert len(report.history.times) == len(report.history.errors) == 61
    assert report.error_estimate_m == pytest.approx(report.history.errors.max(), abs=1e-3)
    assert simulate(made, duration=1.0).report.error_estimate_m is None


@pytest.mark.parametrize("step", [1 / 120, 1 / 240])
def test_half_the_step_changes_the_result_by_less_than_the_estimate(step: float) -> None:
    made = document(
        [node((0, 2, 0), motion={"linearVelocity": [1, 0, 0]}, collider=collider(0)), node(collider=collider(1))], BALL
    )
    coarse = simulate(made, duration=2.0, step=step, estimate_error=True)
    fine = simulate(made, duration=2.0, step=step / 2)
    at = np.arange(121) / 60
    both = [sample_track(next(t for t in run.tracks if t.path == "translation"), at) for run in (coarse, fine)]
    assert np.linalg.norm(both[0] - both[1], axis=1).max() <= 1.001 * (coarse.report.error_estimate_m or 0) + 1e-6


def test_a_late_clip_begins_the_simulation_at_its_start() -> None:
    made = document([node((0, 1, 0), **FALLING), node((3, 0, 0), collider=collider(2))], [*BALL, {"type": "box"}])
    scene = reader.scene(made)
    description = read_description(made, scene.skeleton)
    runs = []
    for start in (0.0, 600.0):
        axis = TimeAxis(np.array([start, start + 1]))
        clip = Clip("side", (Track(1, "translation", Interpolation.LINEAR, axis, np.array([[3.0, 0, 0], [4, 0, 0]])),))
        runs.append(simulate_rigid_bodies(scene, clip, description, RigidOptions(duration=1.0)))
    first, late = (next(t for t in run.tracks if t.path == "translation") for run in runs)
    assert (late.times[0], late.times[-1]) == (600.0, 601.0)
    np.testing.assert_allclose(late.values[-1], first.values[-1], atol=1e-6)
    assert runs[1].report.figures["animated"] == 1


def test_a_document_without_bodies_is_refused() -> None:
    with pytest.raises(RangeError, match="no body to simulate"):
        simulate(document([node(collider=collider(0))], BALL))


@pytest.mark.parametrize("loop", [False, True])
@pytest.mark.parametrize("kind", ["dynamic", "kinematic"])
def test_a_clip_that_moves_every_body_leaves_none_to_simulate(kind: str, *, loop: bool) -> None:
    made = document([node(motion={"isKinematic": kind == "kinematic"}, collider=collider(0))], BALL)
    scene = reader.scene(made)
    clip = Clip("ride", (Track(0, "translation", Interpolation.LINEAR, TimeAxis([0, 1]), [[0, 0, 0], [1, 0, 0]]),))
    with pytest.raises(RangeError, match="the clip moves every body") as caught:
        simulate_rigid_bodies(scene, clip, read_description(made, scene.skeleton), RigidOptions(loop=loop))
    assert "`body`" in caught.value.help


def test_a_duration_of_0_writes_the_start() -> None:
    run = simulate(document([node((0, 1, 0), **FALLING)], BALL), duration=0.0)
    np.testing.assert_allclose(path(run, 0), [[0, 1, 0]], atol=1e-6)
    assert run.report.energy_j is None


def test_warm_up_lets_bodies_settle_before_the_first_frame() -> None:
    made = document([node((0, 1, 0), **FALLING), node(collider=collider(1))], BALL)
    run = simulate(made, duration=1.0, warm_up=3.0)
    np.testing.assert_allclose(path(run, 0)[:, 1], 0.5, atol=0.01)


@pytest.mark.parametrize("friction", [0.4, 0.6])
def test_a_wall_of_hulls_touches_the_floor_without_an_overlap(friction: float) -> None:
    made = opened_fixture("wall")
    scene = reader.scene(made)
    material = Material(friction, friction)
    chosen = ChosenNodes(tuple(range(1, 31)), "hull", material=material)
    description = add_chosen(read_description(made, scene.skeleton), scene, chosen)
    description = replace(description, floor=0.0, floor_material=material)
    run = simulate_rigid_bodies(scene, NO_CLIP, description, RigidOptions(duration=0.5))
    assert run.notes == []
    assert (run.report.penetration_m or 0) < 0.01


def test_a_wall_by_globs_is_the_same_bytes_twice() -> None:
    made = opened_fixture("wall")
    scene = reader.scene(made)
    bricks = tuple(i for i, name in enumerate(scene.skeleton.names) if name.startswith("brick"))
    written = []
    for _ in range(2):
        description = add_chosen(read_description(made, scene.skeleton), scene, ChosenNodes(bricks, "box"))
        run = simulate_rigid_bodies(scene, NO_CLIP, description, RigidOptions(duration=0.5))
        written.append(glb_of(add_rigid_motion(made, run, "fall")))
    assert written[0] == written[1]
    clip = reader.clips(opened(written[0]))[0]
    assert (clip.name, len(clip.tracks), clip.end) == ("fall", 2 * 30, 0.5)
    assert fixtures.FIXTURES["wall"]() == fixtures.build("wall")


@pytest.mark.parametrize("physics", [{}, {"trigger": {"geometry": {"shape": 0}}}])
def test_a_body_without_a_collider_is_noted(physics: dict[str, Any]) -> None:
    run = simulate(document([node((0, 1, 0), motion={}, **physics)], BALL), duration=0.1)
    assert run.notes == ["node 0: a body without a collider (triggers are none) touches nothing"]
