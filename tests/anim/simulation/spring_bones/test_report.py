"""Reports of springs: their figures, and the error estimate by half the step."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.model import Scene
from anim.simulation.integrators import INTEGRATORS
from anim.simulation.spring_bones.chains import SpringBones
from anim.simulation.spring_bones.read import read_spring_bones
from anim.simulation.spring_bones.report import make_report, step_error
from anim.simulation.spring_bones.simulate import SpringOptions, simulate_springs
from anim.simulation.spring_bones.stability import compare_springs
from tests.anim.simulation.spring_bones.swaying import BONES, CHAIN, swaying
from tests.files import opened_fixture

OSCILLATORS = BONES.with_parameters(frequency=4.0, damping_ratio=1.0)


def estimate(bones: SpringBones, options: SpringOptions) -> float:
    prover = Prover(ErrorMetric(Scene(CHAIN, ())))
    return step_error(prover, CHAIN, swaying(), bones, options, simulate_springs(CHAIN, swaying(), bones, options))


@pytest.mark.parametrize("loop", [False, True])
@pytest.mark.parametrize("duration", [None, 0.99])
def test_the_estimate_of_oscillators_falls_with_the_step(duration: float | None, *, loop: bool) -> None:
    errors = [
        estimate(OSCILLATORS, SpringOptions(duration=duration, step=1 / rate, loop=loop)) for rate in (60, 120, 240)
    ]
    assert 0 < errors[2] < 0.7 * errors[1] < 0.5 * errors[0] < 0.02


def test_springs_that_move_no_vertex_have_an_estimate() -> None:
    document = opened_fixture("springs")
    skeleton, (clip,), bones = reader.skeleton(document), reader.clips(document), read_spring_bones(document)
    result = simulate_springs(skeleton, clip, bones)
    error = step_error(Prover(ErrorMetric(reader.scene(document))), skeleton, clip, bones, SpringOptions(), result)
    assert error > 0.01


def test_the_figures_of_a_report() -> None:
    options = SpringOptions(loop=True, warm_up=0.5, fps=30)
    result = simulate_springs(CHAIN, swaying(), OSCILLATORS, options)
    found = make_report(CHAIN, OSCILLATORS, options, result, 0.25, 0.125).to_json()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    expected = {"kind": "springs", "step_s": 1 / 60, "num_steps": 60, "fps": 30, "duration_s": 1.0, "warm_up_s": 0.5}
    expected |= {"error_estimate_m": 0.25, "penetration_m": 0.125, "omega_h_limit": None}
    expected |= {"chains": 1, "joints": 2, "colliders": 0, "oscillators": 2, "replaced_tracks": 0, "loop_settled": True}
    assert {key: found[key] for key in expected} == expected
    assert found["omega_h"] == pytest.approx(2 * np.pi * 4 / 60)
    assert found["loop_seam_m"] < 1e-4
    assert make_report(CHAIN, BONES, SpringOptions(), simulate_springs(CHAIN, swaying(), BONES)).omega_h is None


def test_the_report_of_masses_on_springs_states_energy_stretch_and_the_limit() -> None:
    options = SpringOptions(integrator="verlet")
    found = make_report(CHAIN, OSCILLATORS, options, simulate_springs(CHAIN, swaying(), OSCILLATORS, options)).to_json()
    assert found["integrator"] == "verlet"
    assert found["omega_h_limit"] == pytest.approx(2 * np.sqrt(2) - 2, rel=1e-3)  # at a damping ratio of 1
    assert abs(found["worst_stretch"]["fraction"]) > 0.001
    assert found["energy_j"]["peak"] > 0
    assert (found["advice"], found["first_bad_step"]) == ("", None)


@pytest.mark.parametrize("bones", [BONES, OSCILLATORS])
def test_the_picture_has_every_integrator_on_these_chains(bones: SpringBones) -> None:
    compared = compare_springs(CHAIN, bones, 1 / 60, "")
    assert compared.method == ("exact oscillators" if bones is OSCILLATORS else "VRM's spring bones")
    assert compare_springs(CHAIN, bones, 1 / 60, "rk4").method == "rk4"
    omega = compared.omega_h * 60
    assert omega == pytest.approx(8 * np.pi if bones is OSCILLATORS else np.sqrt(60 * 0.5 / 0.2), rel=1e-6)
    assert {run.name for run in compared.runs} == set(INTEGRATORS)
    assert next(run for run in compared.runs if run.name == "rk4").energy_change == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize("bones", [BONES.with_parameters(gravity=(0, -0.3, 0)), OSCILLATORS])
def test_a_scaled_model_moves_by_the_same_angles_if_asked(bones: SpringBones) -> None:
    factor = 10.0
    larger = replace(CHAIN, scale=np.concatenate([np.full((1, 3), factor), CHAIN.scale[1:]]))
    drive = swaying()
    moves = tuple(t.with_keys(t.times, factor * t.values) if t.path == "translation" else t for t in drive.tracks)
    plain = simulate_springs(CHAIN, drive, bones).clip
    scaled = simulate_springs(larger, replace(drive, tracks=moves), bones, SpringOptions(scale_aware=True)).clip
    for a, b in zip(plain.tracks, scaled.tracks, strict=True):
        if a.path == "rotation":
            np.testing.assert_allclose(a.values, b.values, atol=1e-6)
