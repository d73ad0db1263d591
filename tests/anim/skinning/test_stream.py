"""Chunks, stretches and threads: none of them changes a bit, and memory doesn't grow with the length of a clip."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.arrays import AnyArray
from anim.model import Clip, Instance, Scene
from anim.skinning import stream
from anim.skinning.bake import bake, baker
from anim.skinning.frames import Playback
from anim.skinning.methods import SKINNING_METHODS
from anim.skinning.stream import stretches
from tests.anim.skinning.scenes import TRIANGLE, mesh, random_scene
from tests.anim.skinning.test_linear_blend import moving
from tests.clips import clip, track

FRAMES = 231  # eight chunks of 32, the last one shorter: stretches of 1, 2, 4 and 1 of them


def _scene(method: str) -> tuple[Scene, Clip]:
    """A skinned mesh whose shape is animated, and a rigid one on a joint."""
    random = np.random.default_rng(5)
    of = random_scene(7, stretch=0.3 if method != "lbs" else 0.0, targets=random.normal(size=(2, 150, 3)) / 4)
    rigid = Instance(3, mesh(np.eye(3), np.empty((3, 0)), np.empty((3, 0)), faces=TRIANGLE), None, np.zeros(0))
    of = replace(of, instances=(*of.instances, rigid))
    shapes = track("weights", np.linspace(0, 2, 5), random.random((5, 2)), node=of.instances[0].node)
    return of, clip(*moving(of, 3).tracks, shapes)


def _baked(of: Scene, played: Clip, **how: Any) -> AnyArray:
    return bake(of, played, times=np.linspace(0, 2, FRAMES), rigid=True, **how).whole().positions


@pytest.mark.parametrize("packed", [1, 20_000, 1 << 40], ids=["one chunk", "few chunks", "any number"])
@pytest.mark.parametrize("method", SKINNING_METHODS)
def test_same_bytes_for_any_stretch_and_number_of_threads(
    method: str, packed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    of, played = _scene(method)
    once = _baked(of, played, method=method, threads=1)
    alone = [
        bake(of, played, times=np.array([2 * f / (FRAMES - 1)]), rigid=True, method=method) for f in (40, 130, 230)
    ]
    for frame, one in zip((40, 130, 230), alone, strict=True):
        assert np.array_equal(once[frame], one.whole().positions[0]), "a frame doesn't depend on the others"
    monkeypatch.setattr(stream, "CHUNK", 1)
    monkeypatch.setattr(stream, "PIECE", 7)
    monkeypatch.setattr(stream, "PACKED", packed)
    for threads in (1, 2, 5):
        assert np.array_equal(_baked(of, played, method=method, threads=threads), once)


def test_parts_of_frames_are_the_frames_at_those_times() -> None:
    of, played = _scene("lbs")
    playback, times = Playback(of.skeleton, played), np.linspace(0, 2, 9)
    part, wanted = playback.at(times).part(slice(3, 7)), playback.at(times[3:7])
    assert np.array_equal(part.times, wanted.times)
    assert np.array_equal(part.world, wanted.world)
    assert part.weights.keys() == wanted.weights.keys() == {of.instances[0].node}
    for node, weights in wanted.weights.items():
        assert np.array_equal(part.weights[node], weights)
        assert np.ptp(weights) > 0


@pytest.mark.parametrize(
    ("frames", "step", "most", "lengths"),
    [
        (231, 32, 10_000, [32, 64, 128, 256]),
        (231, 32, 100, [32, 64, 96, 96]),
        (231, 32, 1, [32] * 8),
        (32, 32, 10_000, [32]),
        (33, 32, 10_000, [32, 64]),
        (0, 32, 10_000, []),
    ],
)
def test_stretches_double_as_far_as_they_may(frames: int, step: int, most: int, lengths: list[int]) -> None:
    found = list(stretches(frames, step, most))
    assert [each.stop - each.start for each in found] == lengths
    assert [each.start for each in found] == np.cumsum([0, *lengths])[:-1].tolist()
    assert sum(lengths) >= frames


def test_what_is_packed_at_a_time_is_bounded_for_shapes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Morphed points are as many as those that come out: packed for a whole clip they would take as much."""
    of, played = _scene("lbs")
    seen: list[int] = []
    usual = Playback.at

    def counted(self: Playback, times: Any) -> Any:
        seen.append(len(times))
        return usual(self, times)

    made = baker(of, rigid=True)
    monkeypatch.setattr(Playback, "at", counted)
    monkeypatch.setattr(stream, "CHUNK", 1)
    monkeypatch.setattr(stream, "PACKED", 64 * 36 * 150 + 64 * 96 * 30)
    for _ in made.bake(played, times=np.linspace(0, 2, FRAMES)).chunks():
        pass
    assert seen == [32, 64, 64, 64, 7]
