"""Chunks and threads: neither changes a bit, and memory doesn't grow with the length of a clip."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.arrays import AnyArray
from anim.model import Clip, MeshInstance, Scene
from anim.sampling import PoseSampler
from anim.skinning import chunk_pipeline
from anim.skinning.bake import bake, prepare_bake
from anim.skinning.methods.registry import SKINNING_METHODS
from tests.anim.skinning.methods.test_linear_blend import moving
from tests.anim.skinning.scenes import TRIANGLE, mesh, random_scene
from tests.clips import clip, track

FRAMES = 231  # eight chunks of 32, the last one shorter


def _scene(method: str) -> tuple[Scene, Clip]:
    """A skinned mesh whose shape is animated, and a rigid one on a joint."""
    random = np.random.default_rng(5)
    of = random_scene(7, scale_shear=0.3 if method != "lbs" else 0.0, targets=random.normal(size=(2, 150, 3)) / 4)
    rigid = MeshInstance(3, mesh(np.eye(3), np.empty((3, 0)), np.empty((3, 0)), faces=TRIANGLE), None, np.zeros(0))
    of = replace(of, instances=(*of.instances, rigid))
    shapes = track("weights", np.linspace(0, 2, 5), random.random((5, 2)), node=of.instances[0].node)
    return of, clip(*moving(of, 3).tracks, shapes)


def _baked(of: Scene, played: Clip, **how: Any) -> AnyArray:
    return bake(of, played, times=np.linspace(0, 2, FRAMES), rigid=True, **how).load_all().positions


@pytest.mark.parametrize("packed", [1, 700_000, 1 << 40], ids=["one block", "few blocks", "any number"])
@pytest.mark.parametrize("method", SKINNING_METHODS)
def test_same_bytes_for_any_chunk_and_number_of_threads(
    method: str, packed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    of, played = _scene(method)
    once = _baked(of, played, method=method, threads=1)
    alone = [
        bake(of, played, times=np.array([2 * f / (FRAMES - 1)]), rigid=True, method=method) for f in (40, 130, 230)
    ]
    for frame, one in zip((40, 130, 230), alone, strict=True):
        assert np.array_equal(once[frame], one.load_all().positions[0]), "a frame doesn't depend on the others"
    monkeypatch.setattr(chunk_pipeline, "MIN_VERTICES", 7)
    monkeypatch.setattr(chunk_pipeline, "PACKED_BYTES", packed)
    for threads in (1, 2, 5):
        assert np.array_equal(_baked(of, played, method=method, threads=threads), once)


def test_chunks_that_are_kept_stay_as_they_were(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunk_pipeline, "CHUNK_BYTES", 1)
    of, played = _scene("lbs")
    chunks, copies = [], []
    for chunk in prepare_bake(of, rigid=True).bake(played, times=np.linspace(0, 2, FRAMES)).chunks():
        chunks.append(chunk)
        copies.append(chunk.positions.copy())
    assert len(chunks) == 8
    assert all(np.array_equal(chunk.positions, copy) for chunk, copy in zip(chunks, copies, strict=True))


def test_memory_does_not_grow_with_the_number_of_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    """The caller's chunk, the one that is skinned and the one that follows, with what they are made of."""
    monkeypatch.setattr(chunk_pipeline, "CHUNK_BYTES", 1)
    made = prepare_bake(random_scene(2, vertices=3000))
    for _ in made.bake(Clip("", ()), times=np.zeros(1)).chunks():  # what is made once
        pass
    tracemalloc.start()
    try:
        count = sum(1 for _ in made.bake(Clip("", ()), times=np.linspace(0, 40, 1200)).chunks())
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert count == 38
    assert peak < 5 * 32 * 3000 * 12


def test_what_is_packed_at_a_time_is_bounded_for_shapes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Morphed points are as many as those that come out: packed for a whole clip they would take as much."""
    of, played = _scene("lbs")
    seen: list[int] = []
    usual = PoseSampler.posed

    def counted(self: PoseSampler, times: Any) -> Any:
        seen.append(len(times))
        return usual(self, times)

    made = prepare_bake(of, rigid=True)
    monkeypatch.setattr(PoseSampler, "posed", counted)
    monkeypatch.setattr(chunk_pipeline, "PACKED_BYTES", 64 * 36 * 150 + 64 * 96 * 40)
    for _ in made.bake(played, times=np.linspace(0, 2, FRAMES)).chunks():
        pass
    assert seen == [64, 64, 64, 39]
