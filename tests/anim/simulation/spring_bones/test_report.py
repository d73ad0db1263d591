"""Reports of springs: their figures, and the error estimate by half the step."""

from __future__ import annotations

import json

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.model import Scene
from anim.simulation.spring_bones.chains import SpringBones
from anim.simulation.spring_bones.read import read_spring_bones
from anim.simulation.spring_bones.report import make_report, step_error
from anim.simulation.spring_bones.simulate import SpringOptions, simulate_springs
from tests.anim.simulation.spring_bones.test_simulate import BONES, CHAIN, swaying
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
    found = make_report(OSCILLATORS, options, result, 0.25, 0.125).to_json()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    expected = {"kind": "springs", "step_s": 1 / 60, "num_steps": 60, "fps": 30, "duration_s": 1.0, "warm_up_s": 0.5}
    expected |= {"error_estimate_m": 0.25, "penetration_m": 0.125, "omega_h_limit": None}
    expected |= {"chains": 1, "joints": 2, "colliders": 0, "oscillators": 2, "replaced_tracks": 0, "loop_settled": True}
    assert {key: found[key] for key in expected} == expected
    assert found["omega_h"] == pytest.approx(2 * np.pi * 4 / 60)
    assert found["loop_seam_m"] < 1e-4
    assert make_report(BONES, SpringOptions(), simulate_springs(CHAIN, swaying(), BONES)).omega_h is None
