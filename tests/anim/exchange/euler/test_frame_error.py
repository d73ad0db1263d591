"""Rotations and translations that frames lose: a key between two of them, or the curve of a spline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.exchange.euler import frame_error
from anim.exchange.euler.to_bvh_motion import to_bvh
from anim.model import Interpolation
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, clip, skeleton, track


def test_a_key_between_two_frames_is_lost() -> None:
    hit = clip(track("rotation", [0, 0.45, 0.5, 0.55, 1], about("z", [0, 0, 60, 0, 0])))
    frames = np.array([0, 0.4, 0.6, 1.0])
    angle, time = frame_error.frame_error(hit, frames)
    assert np.degrees(angle) == pytest.approx(60)
    assert time == 0.5
    (note,) = to_bvh(skeleton([-1]), hit, order="XYZ", fps=5).notes
    assert "up to 60° from the clip, at 0.500 s" in note


def test_frames_at_the_keys_lose_nothing() -> None:
    even = clip(track("rotation", [0, 0.5, 1], about("z", [0, 60, 10])))
    assert frame_error.frame_error(even, np.array([0, 0.5, 1]))[0] == pytest.approx(0, abs=1e-7)
    assert to_bvh(skeleton([-1]), even, order="XYZ").notes == ()


def test_a_step_between_two_frames_is_late_but_not_lost() -> None:
    stepped = clip(track("rotation", [0, 0.3, 1], about("z", [0, 60, 10]), STEP))
    assert frame_error.frame_error(stepped, np.array([0, 0.5, 1]))[0] == pytest.approx(0, abs=1e-7)
    assert frame_error.frame_error(stepped, np.array([0.0])) == (0.0, 0.0)
    assert frame_error.frame_error(stepped, np.array([0, 0.2])) == (0.0, 0.0)


def test_a_step_that_ends_before_the_next_frame_is_lost() -> None:
    stepped = clip(track("rotation", [0, 0.512, 0.52, 1], about("z", [0, 90, 10, 0]), STEP))
    angle, time = frame_error.frame_error(stepped, np.arange(31) / 30)
    assert np.degrees(angle) == pytest.approx(80)
    assert time == 0.512
    (note,) = to_bvh(skeleton([-1]), stepped, order="XYZ", fps=30).notes
    assert "up to 80° from the clip, at 0.512 s" in note


@pytest.mark.parametrize("mode", [LINEAR, STEP])
def test_blocks_of_times_are_as_all_at_once(mode: Interpolation, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(3)
    keys = np.unique(random.uniform(0, 9, 60).round(2))
    turned = clip(track("rotation", keys, about("z", random.uniform(-170, 170, len(keys))), mode))
    times = np.linspace(keys[0], keys[-1], 23)
    whole = frame_error.frame_error(turned, times)
    monkeypatch.setattr(frame_error, "BLOCK_VALUES", 7)
    assert frame_error.frame_error(turned, times) == whole


def test_the_curve_of_a_translation_between_frames_is_lost() -> None:
    """A spline from 0 to 0: its frames, at both keys, do not move at all; below a parent of twice the size."""
    out = np.array([[10.0, 0, 0], [0, 0, 0]])
    arc = clip(track("translation", [0, 1], np.zeros((2, 3)), CUBICSPLINE, tangents=(-out[::-1], out), node=1))
    assert frame_error.translation_error(arc, np.array([0.0, 1]), np.array([1.0, 2])) == (5, 0.5)
    rest = replace(skeleton([-1, 0]), scale=np.array([[2.0, 2, 2], [1, 1, 1]]))
    (note,) = to_bvh(rest, arc, order="XYZ").notes
    assert "a node is up to 5 m from the clip, at 0.500 s" in note
    assert to_bvh(rest, arc, order="XYZ", fps=60).notes == ()


def test_translations_of_steps_and_lines() -> None:
    path, one = np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]]), np.ones(1)
    for mode in (LINEAR, STEP):
        moved = clip(track("translation", [0, 0.5, 0.6], path, mode))
        assert frame_error.translation_error(moved, np.array([0, 0.5, 0.6]), one)[0] == pytest.approx(0, abs=1e-9)
        assert frame_error.translation_error(moved, np.array([0.0]), one) == (0.0, 0.0)
    held = clip(track("translation", [0, 0.5, 0.6], path, STEP))
    assert frame_error.translation_error(held, np.array([0, 0.4, 0.7]), one) == (3.0, 0.5)
