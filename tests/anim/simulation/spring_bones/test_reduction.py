"""Fewer keys within an error that is measured on the surface."""

from __future__ import annotations

import pytest

from anim.errors import RangeError
from anim.gltf.reading import reader
from anim.measure.continuous_bound.largest_error import largest_error
from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.simulation.spring_bones.read import read_spring_bones
from anim.simulation.spring_bones.reduction import reduce_keys
from anim.simulation.spring_bones.simulate import SpringOptions, SpringResult, simulate_springs
from tests.files import opened_fixture


@pytest.fixture(scope="module")
def prover() -> Prover:
    return Prover(ErrorMetric(reader.scene(opened_fixture("ponytail"))))


@pytest.fixture(scope="module")
def run() -> SpringResult:
    document = opened_fixture("ponytail")
    (clip,) = reader.clips(document)
    return simulate_springs(reader.skeleton(document), clip, read_spring_bones(document), SpringOptions(loop=True))


@pytest.mark.parametrize("bound", [1e-4, 1e-3, 1e-2])
def test_no_vertex_exceeds_the_error_and_most_of_it_is_used(bound: float, prover: Prover, run: SpringResult) -> None:
    clip, found = reduce_keys(prover, run.clip, run.joints, max_error=bound)
    error = largest_error(prover, run.clip, clip).error.max_error
    assert 0.4 * bound < error <= bound
    assert found.error.max_error == pytest.approx(error)
    others = [(a, b) for a, b in zip(run.clip.tracks, clip.tracks, strict=True) if a.node not in run.joints]
    assert all(a is b for a, b in others)


def test_a_larger_error_leaves_fewer_keys_and_keeps_them_exact(prover: Prover, run: SpringResult) -> None:
    counts = []
    for bound in (1e-4, 1e-3, 1e-2):
        clip, _ = reduce_keys(prover, run.clip, run.joints, max_error=bound)
        counts.append(sum(len(track.times) for track in clip.tracks[-5:]))
        for before, after in zip(run.clip.tracks[-5:], clip.tracks[-5:], strict=True):
            known = dict(zip(before.times.tolist(), before.values.tolist(), strict=True))
            assert all(known[time] == values for time, values in zip(after.times, after.values.tolist(), strict=True))
    assert 305 > counts[0] > counts[1] > counts[2] >= 10


def test_an_error_of_0_is_refused(prover: Prover, run: SpringResult) -> None:
    with pytest.raises(RangeError, match="`max_error` is 0 m"):
        reduce_keys(prover, run.clip, run.joints, max_error=0.0)
