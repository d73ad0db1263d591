"""What frames miss, against arcs and chords."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from anim.arrays import Floats
from anim.model import Clip, Mesh, MeshInstance, Scene
from anim.sampling.times import frame_times
from anim.skinning.analysis.extreme_vertices import extreme_vertices
from anim.skinning.analysis.inbetween_error import InbetweenError, InbetweenMetric
from anim.skinning.bake import Baker, prepare_bake
from tests.anim.skinning.methods.test_linear_blend import moving
from tests.anim.skinning.scenes import random_scene
from tests.clips import CUBICSPLINE, STEP, clip, skeleton, track

POINTS = np.array([[2.0, 0, 0], [0, 0.5, 0], [0, 0, 9]])


def inbetween_error(baker: Baker, clip: Clip, times: Floats) -> InbetweenError:
    return InbetweenMetric(baker).largest_error(clip, times)


def _rigid() -> Baker:
    """Three points on a node."""
    faces, joints, weights = np.array([[0, 1, 2]]), np.empty((3, 0), np.int64), np.empty((3, 0))
    mesh = Mesh("mesh", POINTS, faces, joints, weights, np.empty((0, 3, 3)), np.empty(0))
    return prepare_bake(Scene(skeleton([-1]), (MeshInstance(0, mesh, None, np.empty(0)),)), rigid=True)


def _turning(times: list[float], degrees: list[float]) -> Clip:
    half = np.radians(degrees) / 2
    return clip(track("rotation", times, np.stack((0 * half, 0 * half, np.sin(half), np.cos(half)), axis=1)))


def test_a_turn_misses_what_an_arc_is_above_its_chord() -> None:
    """2 m from the axis, by 90° in 1 s: the middle is r (1 − cos 45°) off; the axis itself is nowhere else."""
    made = _rigid()
    found = inbetween_error(made, _turning([0, 1], [0, 90]), np.array([0.0, 1]))
    assert found.distance == pytest.approx(2 * (1 - np.cos(np.pi / 4)), abs=1e-6)
    assert found.time == 0.5
    slower = inbetween_error(made, _turning([0, 1, 3], [0, 10, 100]), np.array([0.0, 1, 3]))
    assert slower.distance == pytest.approx(found.distance, abs=1e-6)
    assert slower.time == 2.0


def test_a_step_misses_its_whole_jump() -> None:
    """Just before it: who goes straight is there already."""
    made = _rigid()
    jump = clip(track("translation", [0, 1], [[0, 0, 0], [0, 3, 4]], STEP))
    assert inbetween_error(made, jump, np.array([0.0, 1])).distance == pytest.approx(5)


def test_an_eased_move_is_off_but_half_way() -> None:
    """Smoothstep is √3/18 of the way off at most, and not at all half-way."""
    ends = np.array([[0.0, 0, 0], [0, 3, 0]])
    eased = clip(track("translation", [0, 1], ends, CUBICSPLINE, tangents=(0 * ends, 0 * ends)))
    assert inbetween_error(_rigid(), eased, np.array([0.0, 1])).distance == pytest.approx(3 * np.sqrt(3) / 18, rel=0.05)


def test_frames_at_a_rate_miss_the_arc_between_two() -> None:
    made = _rigid()
    found = inbetween_error(made, _turning([0, 1], [0, 90]), frame_times(0, 1, fps=30))
    assert found.distance == pytest.approx(2 * (1 - np.cos(np.radians(1.5))), rel=1e-3)
    assert inbetween_error(made, _turning([0, 8, 9], [0, 0, 90]), frame_times(0, 9, fps=30)).time > 8
    assert inbetween_error(made, Clip("", ()), np.zeros(1)).distance == 0


def test_a_key_between_two_of_many_frames_is_found() -> None:
    """Of the thousands of frames between two keys only some are sampled."""
    there_and_back = _turning([0, 5.2003, 5.2004, 5.2005, 9], [0, 0, 90, 0, 0])
    found = inbetween_error(_rigid(), there_and_back, frame_times(0, 9, fps=1000))
    assert found.time == pytest.approx(5.2004, abs=1e-5)
    assert found.distance == pytest.approx(2 * np.sqrt(2), rel=1e-3)


def test_a_spline_of_quaternions_that_turns_within_one_frame_is_found() -> None:
    """Keys nearly opposite as quaternions: the spline passes near 0, and all of the turn is there."""
    half = np.radians([0, 359.5]) / 2
    keys = np.stack((0 * half, 0 * half, np.sin(half), np.cos(half)), axis=1)
    flip = clip(track("rotation", [0, 4], keys, CUBICSPLINE, tangents=(0 * keys, 0 * keys)))
    found = inbetween_error(_rigid(), flip, frame_times(0, 4, fps=60))
    assert found.time == pytest.approx(2, abs=0.05)
    assert found.distance > 0.5


def test_the_widest_gaps_are_looked_into() -> None:
    """Many gaps, of which one is twice as wide; against every middle of the whole, as one bake."""
    of = random_scene(3)
    played, made = moving(of, 5), prepare_bake(of)
    times = np.delete(np.linspace(0, 8, 64), 30)
    found = inbetween_error(made, played, times)
    middles = (times[1:] + times[:-1]) / 2
    frames = made.bake(played, times=times).load_all().positions
    half = made.bake(played, times=middles[29:30]).load_all().positions
    wanted = np.linalg.norm(half[0] - (frames[29] + frames[30]) / 2, axis=1).max()
    assert found.distance >= wanted - 1e-6
    assert any(low <= found.time <= high for low, high in itertools.pairwise(times))


def test_one_key_between_two_frames_is_found() -> None:
    """A hit of one key among 600, between two frames; and of a STEP track."""
    times = np.arange(601) / 60
    degrees = 10 * np.sin(2 * times)
    degrees[305] += 60
    frames = frame_times(0, 10, fps=30)
    found = inbetween_error(_rigid(), _turning(times.tolist(), degrees.tolist()), frames)
    assert found.time == pytest.approx(305 / 60)
    assert found.distance == pytest.approx(4 * np.sin(np.radians(30)), rel=0.01)
    values = np.zeros((601, 3))
    values[305] = [0, 3, 4]
    stepped = inbetween_error(_rigid(), clip(track("translation", times.tolist(), values, STEP)), frames)
    assert stepped.distance == pytest.approx(5)


def test_few_vertices_have_nearly_the_error_of_all() -> None:
    """On random meshes with skins and targets: every interval, all vertices, at the same times."""
    scene = random_scene(3)
    played, made = moving(scene, 5), prepare_bake(scene)
    times = np.linspace(0, 8, 20)
    dense = np.unique(np.concatenate([times, *(times[:-1] + np.diff(times) * part for part in np.linspace(0, 1, 33))]))
    every = made.bake(played, times=dense).load_all().positions
    frames = every[np.searchsorted(dense, times)]
    at = np.clip(np.searchsorted(times, dense, side="right") - 1, 0, len(times) - 2)
    u = ((dense - times[at]) / np.diff(times)[at])[:, None, None]
    wanted = np.linalg.norm(every - (frames[at] * (1 - u) + frames[at + 1] * u), axis=2).max()
    assert 0.97 * wanted <= inbetween_error(made, played, times).distance <= 1.03 * wanted


def test_vertices_at_the_ends_of_each_joint_are_chosen() -> None:
    points = np.random.default_rng(1).normal(size=(400, 3))
    joints, weights = np.repeat([[0, 1], [1, 0]], 200, axis=0), np.tile([0.75, 0.25], (400, 1))
    targets = np.zeros((1, 400, 3))
    targets[0, 77] = [0, 1, 0]
    mesh = Mesh("mesh", points, np.empty((0, 3), np.int64), joints, weights, targets, np.zeros(1))
    chosen = extreme_vertices(mesh).tolist()
    wanted = {77} | {int(first + points[first : first + 200, axis].argmax()) for first in (0, 200) for axis in range(3)}
    wanted |= {int(first + points[first : first + 200, axis].argmin()) for first in (0, 200) for axis in range(3)}
    assert set(chosen) == wanted
