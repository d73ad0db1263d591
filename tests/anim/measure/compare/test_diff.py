"""Whole files: which clips are held against which, and what only one has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.measure.compare import diff as compare
from anim.measure.compare.diff import diff
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.model import Clip, Scene
from anim.operations.resample import resample
from tests.clips import about, clip, skeleton, track

SCENE = Scene(skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]]), ())


def _moved(name: str, meters: float, end: float = 1) -> Clip:
    return clip(track("translation", [0, end], np.array([[0, 0, 0], [meters, 0, 0]])), name=name)


def test_the_worst_clip_comes_first() -> None:
    old = [_moved("a", 1), _moved("b", 1), _moved("c", 1)]
    new = [_moved("c", 1.5), _moved("a", 1.25), _moved("b", 1)]
    found = diff(ErrorMetric(SCENE), old, new)
    assert [(each.name, each.old, each.new) for each in found.clips] == [("c", 2, 0), ("a", 0, 1), ("b", 1, 2)]
    assert [each.error.max_error for each in found.clips] == pytest.approx([0.5, 0.25, 0], rel=1e-3)
    assert found.clips[0].statistics.speed.size == pytest.approx(0.5, rel=0.02)
    assert found.diagonal == 1


def test_equal_clips_are_measured_once(monkeypatch: pytest.MonkeyPatch) -> None:
    measured: list[str] = []

    def seen(*clips: Clip, fps: float) -> Floats:
        measured.append(clips[0].name)
        return dense_times(*clips, fps=fps)

    monkeypatch.setattr(compare, "dense_times", seen)
    old = [_moved(name, 1) for name in "abcd"]
    new = [_moved("a", 1.5), _moved("b", 1.5), _moved("c", 1.25), _moved("d", 1.5)]
    found = diff(ErrorMetric(SCENE), old, new)
    assert [(each.name, each.new_name, each.old, each.new) for each in found.clips] == [
        ("a", "a", 0, 0),
        ("b", "b", 1, 1),
        ("d", "d", 3, 3),
        ("c", "c", 2, 2),
    ]
    assert [each.error.max_error for each in found.clips] == pytest.approx([0.5, 0.5, 0.5, 0.25], rel=1e-3)
    assert measured == ["a", "c"]


def test_clips_that_only_one_has() -> None:
    old, new = [_moved("a", 1), _moved("b", 1)], [_moved("b", 1), _moved("x", 1), _moved("y", 1)]
    found = diff(ErrorMetric(SCENE), old, new)
    assert [each.name for each in found.clips] == ["b"]
    assert (found.missing_clips, found.added_clips) == ((0,), (1, 2))
    chosen = diff(ErrorMetric(SCENE), old, new, chosen=[1])
    assert (chosen.missing_clips, chosen.added_clips) == ((), ())


def test_tracks_and_ends_that_only_one_has() -> None:
    before = clip(*_moved("a", 1).tracks, track("rotation", [0, 1], about("z", [0, 9]), node=1), name="a")
    after = clip(*_moved("a", 1, end=0.75).tracks, track("/materials/0/alphaCutoff", [0], [[1]]), name="a")
    (found,) = diff(ErrorMetric(SCENE), [before], [after]).clips
    assert found.missing == (("1", "rotation"),)
    assert found.added == (("/materials/0/alphaCutoff", "pointer"),)
    assert (found.end_old, found.end_new) == (1, 0.75)
    assert np.degrees(found.statistics.angle.size) == pytest.approx(9)


def test_nodes_that_only_one_has() -> None:
    other = Scene(replace(skeleton([-1, 0, 0]), names=("0", "x", "y")), ())
    found = diff(ErrorMetric(SCENE, other), [], [])
    assert (found.missing_nodes, found.added_nodes, found.clips) == (("1",), ("x", "y"), ())


def test_a_player_shows_what_another_does_not() -> None:
    """A quarter turn in one step against the same in many: 0.92° apart where components are mixed one by one."""
    one = clip(track("rotation", [0, 1], about("z", [0, 90])), name="a")
    many = resample(one, fps=64)
    by_player = {
        player: diff(ErrorMetric(SCENE), [one], [many], player=player).clips[0].statistics.angle.size
        for player in ("spec", "nlerp")
    }
    assert np.degrees(by_player["spec"]) < 1e-4
    assert np.degrees(by_player["nlerp"]) == pytest.approx(0.92, abs=0.01)
