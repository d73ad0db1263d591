"""Batches of clips that are optimized side by side: the result does not depend on them."""

from __future__ import annotations

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.model import Scene
from anim.optimization import clip_batches
from anim.optimization.clip import Task
from anim.optimization.clip_batches import BATCH_CLIPS, BATCH_KEYS, BATCH_MATRICES, batch_clips
from anim.optimization.options import Bounds, Drop, Packing, Policy
from anim.sampling import scene_parts
from anim.sampling.scene_parts import SceneDivider
from tests.anim.optimization.making import task_of
from tests.anim.optimization.optimizing import optimized, request_for
from tests.arms import arms
from tests.clips import clip, track
from tests.clips import skeleton as skeleton_of
from tests.files import glb_of, opened, opened_fixture


def _task(keys: int) -> Task:
    """A clip whose longest track has some number of keys, with a shorter one beside it."""
    lengths = (min(keys, 2), keys)
    tracks = [track("scale", np.arange(n), np.ones((n, 3)), node=node) for node, n in enumerate(lengths) if n]
    return task_of(clip(*tracks), 1.0)


def _lengths(batches: list[list[tuple[int, Task]]]) -> list[list[int]]:
    return [[max((len(each.times) for each in task.clip.tracks), default=0) for _, task in some] for some in batches]


def _batches(tasks: list[tuple[int, Task]], nodes: int) -> list[list[tuple[int, Task]]]:
    """Batches in a scene of some number of nodes, all below the first one."""
    return batch_clips(tasks, SceneDivider(Scene(skeleton_of([-1] + [0] * (nodes - 1)), ())))


def _numbers(batches: list[list[tuple[int, Task]]]) -> list[int]:
    return [number for some in batches for number, _ in some]


def test_batches_have_so_many_keys_at_most_the_longest_first() -> None:
    random = np.random.default_rng(3)
    tasks = list(enumerate(map(_task, [*random.integers(1, 200, 60).tolist(), BATCH_KEYS, 3 * BATCH_KEYS])))
    batches = _batches(tasks, 1)
    lengths = _lengths(batches)
    assert sorted(_numbers(batches)) == list(range(62))
    every = [length for some in lengths for length in some]
    assert every == sorted(every, reverse=True)
    assert lengths[:2] == [[3 * BATCH_KEYS], [BATCH_KEYS]]
    for some in lengths[1:-1]:
        assert some[0] * len(some) <= BATCH_KEYS
        assert len(some) == BATCH_CLIPS or some[0] * (len(some) + 1) > BATCH_KEYS


def test_scenes_of_many_nodes_have_smaller_batches() -> None:
    tasks = list(enumerate(map(_task, [10] * 6)))
    assert _lengths(_batches(tasks, BATCH_MATRICES // 20)) == [[10, 10]] * 3
    assert _lengths(_batches(tasks, 10 * BATCH_MATRICES)) == [[10]] * 6


def test_batches_follow_from_the_clips_and_not_from_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clip_batches, "BATCH_KEYS", 300)
    tasks = list(enumerate(map(_task, [30, 100, 30, 7, 250, 350, 7])))
    for some in (tasks, tasks[::-1]):
        assert [_numbers([batch]) for batch in _batches(some, 1)] == [[5], [4], [1, 0, 2], [3, 6]]


@pytest.mark.parametrize("lengths", [[], [0], [0, 0], [0, 5]])
def test_clips_without_tracks(lengths: list[int]) -> None:
    tasks = [(n, _task(length)) for n, length in enumerate(lengths)]
    found = _batches(tasks, 1)
    assert sorted(_numbers(found)) == list(range(len(lengths)))
    assert all(found)


def _bytes(document: Document, name: str, batch_keys: int, monkeypatch: pytest.MonkeyPatch) -> bytes:
    monkeypatch.setattr(clip_batches, "BATCH_KEYS", batch_keys)
    requests = {
        "core": request_for(document, 1e-3),
        "ext": request_for(document, 1e-3, packing=Packing.EXT, effort="balanced"),
        "speed": request_for(document, 1e-2, bounds=Bounds(0.0, 0.0, max_speed_error=0.02)),
        "angle": request_for(document, 1e-2, bounds=Bounds(0.0, 0.0, max_angle=np.radians(0.05))),
        "exact": request_for(document, 0.0, policy=Policy(Drop.REST)),
    }
    return glb_of(optimized(document, requests[name])[0].document)


@pytest.mark.parametrize("name", ["core", "ext", "speed", "angle", "exact"])
@pytest.mark.parametrize("fixture", ["noop", "pointer"])
def test_the_same_bytes_for_any_batches(fixture: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    document = opened_fixture(fixture)
    assert len(reader.clips(document)) > 1
    alone, together = (_bytes(document, name, keys, monkeypatch) for keys in (0, 10**9))
    assert alone == together


@pytest.mark.parametrize("effort", ["fast", "balanced"])
def test_the_same_bytes_on_parts_of_the_scene(effort: str, monkeypatch: pytest.MonkeyPatch) -> None:
    document = opened(arms(24))
    request = request_for(document, 1e-3, effort=effort, policy=Policy(Drop.REST, keep=frozenset({13, 20})))
    on_parts, _ = optimized(document, request, detailed=True)
    monkeypatch.setattr(scene_parts, "MIN_NODES", 10**9)
    on_whole, _ = optimized(document, request, detailed=True)
    assert glb_of(on_parts.document) == glb_of(on_whole.document)
    for number, one in on_parts.verdicts.items():
        other = on_whole.verdicts[number]
        assert (one.error.place, one.error.joint, one.player) == (other.error.place, other.error.joint, other.player)
        assert one.error.max_error == pytest.approx(other.error.max_error, rel=1e-6)
        assert one.certified == pytest.approx(other.certified, rel=1e-2)
        assert one.statistics is not None
        assert other.statistics is not None
        assert one.statistics.mean == pytest.approx(other.statistics.mean, rel=1e-6, abs=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["core", "ext", "speed", "angle"])
def test_the_same_bytes_of_long_clips_for_any_batches(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    document = opened_fixture("biped")
    assert len(reader.clips(document)) > 2
    alone, together = (_bytes(document, name, keys, monkeypatch) for keys in (0, 10**9))
    assert alone == together
