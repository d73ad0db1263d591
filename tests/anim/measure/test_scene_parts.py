"""Clips that each move few of many nodes: measured as on the whole scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.measure.compare.diff import ClipDiff, diff
from anim.measure.continuous_bound import clip_groups
from anim.measure.continuous_bound.largest_error import largest_error
from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.inspect import root_motion
from anim.measure.loops import divided_ranges
from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.divided_ranges import measure_on_parts
from anim.measure.loops.end_frames import find_end_frames
from anim.measure.loops.joint_gaps import joint_gaps
from anim.measure.loops.loop_analysis import analyze_loops
from anim.measure.loops.seam import measure_seams
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Scene
from anim.operations.resample import resample
from anim.sampling import scene_parts
from anim.sampling.clips import sample_world_matrices
from tests.arms import arms
from tests.clips import clip, track
from tests.files import opened

ARMS = opened(arms(40))
SCENE, CLIPS = reader.scene(ARMS), reader.clips(ARMS)
ROOTS = [root_motion.root_motion_node(SCENE.skeleton, each) for each in CLIPS]
RANGES = [LoopRange(each, each.start, each.end, root=root) for each, root in zip(CLIPS, ROOTS, strict=True)]
SEAMS = measure_seams(SkinMotion(SCENE), RANGES)
NEW = tuple(resample(each, fps=7) for each in CLIPS)


def _both(measure: Callable[[], Any], monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Any]:
    """Results on parts and on the whole scene."""
    on_parts = measure()
    monkeypatch.setattr(scene_parts, "MIN_NODES", 10**9)
    return on_parts, measure()


def _gaps() -> Any:
    return measure_on_parts(SkinMotion(SCENE), RANGES, joint_gaps)


@pytest.mark.parametrize(
    "measure",
    [
        lambda: analyze_loops(SkinMotion(SCENE), CLIPS, ROOTS),
        lambda: find_end_frames(SkinMotion(SCENE), CLIPS, ROOTS, [each.gap for each in SEAMS]),
        _gaps,
    ],
    ids=["loops", "end frames", "joint gaps"],
)
def test_loops(measure: Callable[[], Any], monkeypatch: pytest.MonkeyPatch) -> None:
    parts = 0

    def counted(skin: SkinMotion, part: scene_parts.ScenePart) -> SkinMotion:
        nonlocal parts
        parts += 1
        return whole_part(skin, part)

    whole_part = SkinMotion.part
    monkeypatch.setattr(SkinMotion, "part", counted)
    on_parts, on_whole = _both(measure, monkeypatch)
    assert parts > 1
    assert repr(on_parts) == repr(on_whole)
    assert len({repr(each) for each in on_whole}) > 1


def test_a_root_outside_of_the_part_does_not_move() -> None:
    elsewhere = [8 if number != 2 else 12 for number in range(len(CLIPS))]
    found = analyze_loops(SkinMotion(SCENE), CLIPS, elsewhere)
    assert [each.travel for i, each in enumerate(found) if i not in (2, 3)] == [0.0] * 38


def test_roots_move_as_on_all_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(root_motion, "BLOCK_CLIPS", 7)
    found = root_motion.root_motions(SCENE.skeleton, CLIPS)
    for each, way in zip(CLIPS, found, strict=True):
        world, _ = sample_world_matrices(SCENE.skeleton, [each], np.array([[each.start, each.end]]))
        start, end = world[way.root, :, :, 3]
        assert way.distance == (np.linalg.norm(end - start) if way.root >= 0 else 0.0)
    assert max(each.distance for each in found) > 0.01
    nowhere = frozenset[int]()
    assert {each.root for each in root_motion.root_motions(SCENE.skeleton, CLIPS, figure=nowhere)} == {-1}


def test_differences(monkeypatch: pytest.MonkeyPatch) -> None:
    def measure() -> list[ClipDiff]:
        return sorted(diff(ErrorMetric(SCENE, shell=0.01), CLIPS, NEW).clips, key=lambda each: each.old)

    for one, other in zip(*_both(measure, monkeypatch), strict=True):
        assert one.error.max_error == pytest.approx(other.error.max_error, rel=1e-9)
        assert (one.error.place, one.error.joint, one.error.vertex) == (
            other.error.place,
            other.error.joint,
            other.error.vertex,
        )
        assert one.certified == pytest.approx(other.certified, rel=1e-9)
        assert one.statistics.mean == pytest.approx(other.statistics.mean, rel=1e-9, abs=1e-15)
        assert one.statistics.p99 == pytest.approx(other.statistics.p99, rel=1e-9, abs=1e-15)
        assert one.statistics.angle == other.statistics.angle


def _with(**changed: Any) -> Scene:
    return reader.scene(replace(ARMS, json={**ARMS.json, **changed}))


def _node(number: int, **changed: Any) -> list[Any]:
    nodes = list(ARMS.json["nodes"])
    nodes[number] = {key: value for key, value in {**nodes[number], **changed}.items() if value is not None}
    return nodes


@pytest.mark.parametrize(
    "nodes",
    [
        _node(36, translation=[5, 5, 5]),
        _node(37, mesh=None),
        _node(4 * 40, skin=None),
        [*ARMS.json["nodes"], {"name": "more"}],
    ],
    ids=["rest pose", "lost mesh", "lost skin", "another node"],
)
def test_differences_of_what_no_clip_moves(nodes: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    other = _with(nodes=nodes)

    def measure() -> list[str]:
        return [repr(each) for each in diff(ErrorMetric(SCENE, other, shell=0.01), CLIPS[:4], CLIPS[:4]).clips]

    on_parts, on_whole = _both(measure, monkeypatch)
    assert on_parts == on_whole


def test_vertices_of_repeated_primitives_are_not_counted_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, *others = ARMS.json["meshes"]
    thrice = replace(ARMS, json={**ARMS.json, "meshes": [{"primitives": 3 * mesh["primitives"]}, *others]})
    scene = reader.scene(thrice, repeats=False)

    def measure() -> list[float]:
        found = diff(ErrorMetric(scene, shell=0.01), CLIPS[:4], NEW[:4]).clips
        return [value for each in found for value in (each.statistics.mean, each.statistics.p99)]

    on_parts, on_whole = _both(measure, monkeypatch)
    assert on_parts == pytest.approx(on_whole, rel=1e-9)
    assert max(on_whole) > 1e-4


def test_clips_with_a_pointer_to_a_material(monkeypatch: pytest.MonkeyPatch) -> None:
    pointer = track("/materials/0/pbrMetallicRoughness/metallicFactor", [0, 1], [[0], [1]])
    pairs = [(clip(*one.tracks, pointer), clip(*other.tracks, pointer)) for one, other in zip(CLIPS, NEW, strict=True)]
    prover = Prover(ErrorMetric(SCENE))
    on_parts, on_whole = _both(lambda: clip_groups.largest_error_of(prover, pairs), monkeypatch)
    assert on_parts.error.max_error == pytest.approx(on_whole.error.max_error, rel=1e-6)
    assert on_parts.error.joint == on_whole.error.joint


def test_the_largest_error_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = []

    def counted(prover: Prover, *clips: Any, floor: float) -> Any:
        sizes.append(len(prover.ruler.scene.skeleton))
        return largest_error(prover, *clips, floor=floor)

    monkeypatch.setattr(clip_groups, "largest_error", counted)
    prover = Prover(ErrorMetric(SCENE))
    on_parts, on_whole = _both(lambda: clip_groups.largest_error_of(prover, zip(CLIPS, NEW, strict=True)), monkeypatch)
    assert on_parts.error.max_error == pytest.approx(on_whole.error.max_error, rel=1e-6)
    assert (on_parts.error.joint, on_parts.error.place) == (on_whole.error.joint, on_whole.error.place)
    assert on_parts.bound == pytest.approx(on_whole.bound, rel=1e-2)
    assert sizes[0] < 40 * 8


def test_few_clips_are_measured_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(divided_ranges, "MIN_VALUES", 10**9)
    seen: list[int] = []

    def measure(skin: SkinMotion, ranges: Any) -> list[None]:
        seen.append(len(skin.skeleton))
        return [None] * len(ranges)

    measure_on_parts(SkinMotion(SCENE), [LoopRange(each, 0, 1) for each in CLIPS], measure)
    assert seen == [len(SCENE.skeleton)]
