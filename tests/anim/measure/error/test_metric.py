"""The largest displacement by hand: how far, where and when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.reading import reader
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.motion_error import MotionError
from anim.measure.error.posed_clips import AskedTimes
from anim.measure.error.sample_times import key_and_mid_times
from anim.model import Scene
from tests.anim.measure.error.brute_force import clip_of, points_on_a_node, with_track
from tests.clips import STEP, about, clip, skeleton, track
from tests.files import opened_fixture


def test_a_key_moved_by_a_millimeter_is_found_where_and_when_it_is() -> None:
    document = opened_fixture("biped")
    scene, walk = reader.scene(document), clip_of(document, "walk")
    hips = next(i for i, each in enumerate(walk.tracks) if each.path == "translation")
    moved = walk.tracks[hips].values.copy()
    moved[7, 1] += 0.001
    after = with_track(walk, hips, replace(walk.tracks[hips], values=moved))
    found = ErrorMetric(scene).error(walk, after)
    assert found.max_error == pytest.approx(0.001, rel=0.02)
    assert found.time == walk.tracks[hips].times[7]


def test_a_joint_turned_by_a_degree_is_named() -> None:
    document = opened_fixture("biped")
    scene, walk = reader.scene(document), clip_of(document, "walk")
    name = "head"
    number = next(i for i, n in enumerate(scene.skeleton.names) if n.lower() == name)
    index = next(i for i, each in enumerate(walk.tracks) if each.target == (number, "rotation"))
    turned = walk.tracks[index].values.copy()
    turned[3] = _product(walk.tracks[index].values[3], about("x", 1))
    found = ErrorMetric(scene).error(walk, with_track(walk, index, replace(walk.tracks[index], values=turned)))
    assert found.time == walk.tracks[index].times[3]
    assert found.joint == scene.skeleton.names[number]
    assert 0.001 < found.max_error < 0.01


def test_a_rigid_mesh_by_hand() -> None:
    """A point at (3, 4, 0) on a node that turns 1° about z: the chord of 5 m under 1°."""
    scene = points_on_a_node([[3, 4, 0], [1, 0, 0]])
    before = clip(track("rotation", [0, 1], about("z", [0, 0])))
    after = clip(track("rotation", [0, 1], about("z", [0, 1])))
    found = ErrorMetric(scene).error(before, after)
    assert found.max_error == pytest.approx(10 * np.sin(np.radians(0.5)), rel=1e-12)
    assert (found.time, found.joint, found.place) == (1.0, "0", "points")


def test_morph_weights_alone_by_hand() -> None:
    """A target of 2 m, its weight off by a quarter half-way."""
    scene = points_on_a_node([[0, 0, 0], [1, 0, 0]], targets=[[[0, 0, 0], [0, 2, 0]]])
    before, after = (clip(track("weights", [0, 1, 2], np.array([[0], [w], [0]]))) for w in (0.5, 0.75))
    found = ErrorMetric(scene).error(before, after)
    assert found.max_error == pytest.approx(0.5, rel=0.02)
    assert found.time == 1.0


def test_an_error_between_keys_shows_at_the_middle() -> None:
    scene = points_on_a_node([[0, 0, 0]])
    before = clip(track("translation", [0, 1, 2], [[0, 0, 0], [0, 1, 0], [0, 0, 0]]))
    after = clip(track("translation", [0, 2], [[0, 0, 0], [0, 0, 0]]))
    assert ErrorMetric(scene).error(before, after).max_error == pytest.approx(1)
    jump = clip(track("translation", [0, 1], [[0, 0, 0], [0, 1, 0]], STEP))
    later = clip(track("translation", [0, 1.5], [[0, 0, 0], [0, 1, 0]], STEP))
    found = ErrorMetric(scene).error(jump, later)
    assert found.max_error == pytest.approx(1)
    assert 1 <= found.time < 1.5


def test_a_scene_without_vertices_is_measured_at_its_nodes() -> None:
    """Two nodes, 1 m apart: each carries a cube of 2 % of that, which shows turns too."""
    scene = Scene(skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]]), ())
    before = clip(track("rotation", [0], about("z", [0]), node=0))
    after = clip(track("rotation", [0], about("z", [1]), node=0))
    found = ErrorMetric(scene).error(before, after)
    assert found.place == "1"
    assert found.max_error == pytest.approx(2 * np.sin(np.radians(0.5)) * np.hypot(1.01, 0.01), rel=1e-6)
    leaf = clip(track("rotation", [0], about("z", [2]), node=1))
    assert ErrorMetric(scene).error(clip(), leaf).max_error == pytest.approx(
        0.02 * np.sqrt(2) * np.sin(np.radians(1)), rel=1e-6
    )


def test_a_scene_of_no_size_and_one_of_nothing() -> None:
    alone = Scene(skeleton([-1]), ())
    moved = clip(track("translation", [0], [[0.001, 0, 0]]))
    assert ErrorMetric(alone).error(clip(), moved).max_error == pytest.approx(0.001)
    assert ErrorMetric(alone).error(clip(), clip()) == MotionError(0.0, 0.0, "", "", 1)
    nothing = Scene(skeleton([]), ())
    assert ErrorMetric(nothing).error(clip(), clip()).max_error == 0
    assert ErrorMetric(nothing).diagonal == 0


def test_times_that_are_looked_at() -> None:
    """All keys of both, and the middle of every gap."""
    a, b = clip(track("scale", [0, 1], np.ones((2, 3)))), clip(track("scale", [0.5, 1], np.ones((2, 3))))
    assert key_and_mid_times(a, b).tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert key_and_mid_times(clip()).tolist() == [0]


def test_chosen_times_only() -> None:
    scene = points_on_a_node([[0, 0, 0]])
    before = clip(track("translation", [0, 1, 2], [[0, 0, 0], [0, 1, 0], [0, 0, 0]]))
    found = ErrorMetric(scene).error_at(before, clip(), np.array([0.25]))
    assert found.max_error == pytest.approx(0.25)
    assert (found.time, found.times) == (0.25, 1)
    assert ErrorMetric(scene).error_at(before, clip(), np.empty(0)).max_error == 0


def test_pointers_are_compared_as_a_share_of_their_range() -> None:
    cutoff, factor = "/materials/0/alphaCutoff", "/materials/0/emissiveFactor"
    before = clip(track(cutoff, [0, 1], [[10], [30]]), track(factor, [0, 1], [[1, 2, 3], [1, 2, 3]]))
    after = clip(track(cutoff, [0, 1], [[10], [31]]), track(factor, [0, 1], np.array([[1, 2, 3.03], [1, 2, 3]])))
    found = ErrorMetric(points_on_a_node([[0, 0, 0]])).error(before, after)
    assert found.max_error == 0
    assert found.max_pointer_error == pytest.approx(1 / 20)
    assert found.pointer == cutoff
    constant = ErrorMetric(points_on_a_node([[0, 0, 0]])).error(clip(before.tracks[1]), clip(after.tracks[1]))
    assert constant.max_pointer_error == pytest.approx(0.03 / 3)


def test_weights_that_move_no_vertex_are_compared_as_a_share_of_their_range() -> None:
    """The second target moves the point, and its error is a distance."""
    scene = points_on_a_node([[0, 0, 0]], targets=[[[0, 0, 0]], [[0, 1, 0]]])
    before = clip(track("weights", [0, 1], [[0.0, 0.0], [2.0, 1.0]]))
    after = clip(track("weights", [0, 1], [[0.0, 0.0], [1.5, 0.9]]))
    found = ErrorMetric(scene).error(before, after)
    assert found.max_error == pytest.approx(0.1)
    assert found.max_pointer_error == pytest.approx(0.25)
    assert found.pointer.startswith("the weights of ")
    moving = clip(track("weights", [0, 1], [[0.0, 0.0], [2.0, 0.9]]))
    assert ErrorMetric(scene).error(before, moving).max_pointer_error == 0


def _product(a: Floats, b: Floats) -> Floats:
    av, aw, bv, bw = a[:3], a[3], b[:3], b[3]
    return np.array([*(aw * bv + bw * av + np.cross(av, bv)), aw * bw - av @ bv])


def test_poses_at_a_time_that_is_asked_for_twice() -> None:
    """A continuous bound does so where an interval has no middle."""
    scene = points_on_a_node([[1, 0, 0]])
    before = clip(track("rotation", [0, 1], about("z", [0, 60])))
    after = clip(track("rotation", [0, 1], about("z", [0, 90])))
    asked = [
        AskedTimes("spec", np.array([0, 0.5, 1, 1]), np.zeros(4, int)),
        AskedTimes("nlerp", np.array([0.0, 1]), np.zeros(2, int)),
    ]
    for pose in ErrorMetric(scene).posed([(before, after)], asked):
        np.testing.assert_array_equal(pose.times, [0, 0.5, 1, 1, 0, 1])
