"""Many short clips measured at once, against one after the other."""

from __future__ import annotations

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.measure.continuous_bound import clip_groups
from anim.measure.continuous_bound.clip_groups import largest_error_of, worst_proof
from anim.measure.continuous_bound.largest_error import largest_error
from anim.measure.continuous_bound.prover import Proof, Prover
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip, Scene
from anim.operations.resample import resample
from anim.operations.spline import spline
from tests import many
from tests.clips import about, clip, track
from tests.files import opened, opened_fixture

RNG = np.random.default_rng(4)
SKINNED = reader.scene(opened_fixture("arm"))
RIGID = reader.scene(opened(many.clips_equal(1)))


def _clip(scene: Scene, keys: int) -> Clip:
    """All nodes turned at random, the last one moved as well."""
    times, count = range(keys), len(scene.skeleton)
    turned = [track("rotation", times, about("z", RNG.uniform(-90, 90, keys)), node=i) for i in range(count)]
    return clip(*turned, track("translation", times, RNG.normal(size=(keys, 3)), node=count - 1))


def _pairs(scene: Scene) -> list[tuple[Clip, Clip]]:
    clips = [_clip(scene, keys) for keys in (2, 3) for _ in range(12)]
    return [(each, resample(each, fps=0.7) if n % 4 else spline(each)) for n, each in enumerate(clips)]


@pytest.mark.parametrize("scene", [SKINNED, RIGID], ids=["skinned", "rigid"])
def test_the_largest_error_is_that_of_the_worst_clip(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    pairs = _pairs(scene)
    prover = Prover(ErrorMetric(scene))
    each = worst_proof([largest_error(prover, *pair) for pair in pairs])
    calls = 0

    def counted(prover: Prover, before: Clip, after: Clip, *, floor: float) -> Proof:
        nonlocal calls
        calls += 1
        return largest_error(prover, before, after, floor=floor)

    monkeypatch.setattr(clip_groups, "largest_error", counted)
    found = largest_error_of(prover, pairs)
    assert each is not None
    assert found is not None
    assert found.bound is not None
    assert found.error.max_error == pytest.approx(each.error.max_error, rel=1e-3)
    assert (found.error.joint, found.error.time) == (each.error.joint, each.error.time)
    assert found.error.max_error <= found.bound <= 1.02 * found.error.max_error
    assert calls < len(pairs) / 2


def test_clips_with_pointers_are_measured_alone() -> None:
    pointer = track("/materials/0/alphaCutoff", [0, 1], [[0.0], [1.0]])
    clips = [(clip(pointer), clip(pointer.with_keys([0, 1], [[0.0], [n / 10]]))) for n in range(10)]
    found = largest_error_of(Prover(ErrorMetric(RIGID)), clips)
    assert found is not None
    assert found.error.max_error == 0


def test_no_clips_have_no_error() -> None:
    assert largest_error_of(Prover(ErrorMetric(RIGID)), []) is None
