"""Loops: what kind a clip is, and that closing it leaves no seam."""

from __future__ import annotations

import numpy as np
import pytest

import fixtures
from anim.curves.tangents.table import TANGENTS
from anim.errors import RangeError
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.measure.inspect.root_motion import traveling_root
from anim.measure.loops.loop_analysis import LoopKind, best_ranges
from anim.measure.loops.loop_analysis import loop as judged
from anim.measure.loops.seam import SkinMotion
from anim.model import Clip, Scene, Track
from anim.ops.loop import append_first_frame, loop
from anim.ops.spline import spline
from anim.ops.trim import trim
from anim.sampling.derivatives import rates
from anim.sampling.track import sample
from tests.anim.ops.tracks import TRACKS
from tests.files import opened


def _walk() -> tuple[Scene, Clip]:
    document = opened(fixtures.build("biped"))
    return reader.scene(document), next(clip for clip in reader.clips(document) if clip.name == "walk")


SCENE, WALK = _walk()
SKELETON = SCENE.skeleton
SKIN = SkinMotion(SCENE)


def test_the_walk_is_closed() -> None:
    assert judged(SCENE, WALK).kind is LoopKind.CLOSED


def test_without_its_last_frame_it_is_open_by_one() -> None:
    cut = trim(WALK, end=23 / 24)
    found = judged(SCENE, cut)
    assert found.kind is LoopKind.OPEN_BY_ONE_FRAME
    closed = append_first_frame(cut, fps=found.fps)
    assert closed.end == pytest.approx(1.0, abs=1e-6)
    assert judged(SCENE, closed).kind is LoopKind.CLOSED
    assert judged(SCENE, closed).seam < 1e-6


def test_half_a_walk_is_no_loop() -> None:
    assert judged(SCENE, trim(WALK, end=0.5)).kind is LoopKind.NOT_A_LOOP


def test_blend_closes_it() -> None:
    half = trim(WALK, end=0.5)
    closed = loop(half, blend=0.25)
    assert judged(SCENE, closed).seam < 1e-9
    early = np.linspace(0, 0.24, 50)
    for old, new in zip(half.tracks, closed.tracks, strict=True):
        np.testing.assert_allclose(sample(new, early), sample(old, early), atol=1e-9)


@pytest.mark.parametrize("key", ["cubic", "turning", "linear", "slerp", "step"])
def test_ends_meet_in_value_and_splines_in_speed(key: str) -> None:
    new = loop(Clip("", (TRACKS[key],)), blend=1.0).tracks[0]
    first, last = sample(new, np.array([0.0, 3.0]))
    assert min(np.abs(first - last).max(), np.abs(first + last).max()) < 1e-9
    if key in ("cubic", "turning"):
        start, end = rates(new, np.array([0.0]), before=False), rates(new, np.array([3.0]), before=True)
        np.testing.assert_allclose(end, start, atol=0.05 * np.abs(start).max() if key == "turning" else 1e-9)


def test_blend_longer_than_the_clip_is_refused() -> None:
    with pytest.raises(RangeError, match="blend"):
        loop(WALK, blend=1.5)


def test_the_best_part_of_two_walks_is_one_walk() -> None:
    twice = Clip("", tuple(Track(t.node, t.path, t.interpolation, _lap(t.times), _again(t)) for t in WALK.tracks))
    best = best_ranges(SKIN, twice, shortest=0.8)[0]
    assert best.end - best.start == pytest.approx(1.0, abs=1e-3)
    assert best.seam < 1e-4


def test_a_root_that_walks_on_travels_and_one_that_sways_does_not() -> None:
    assert traveling_root(SKELETON, WALK) == -1
    hips = next(i for i, t in enumerate(WALK.tracks) if t.path == "translation")
    track = WALK.tracks[hips]
    on = track.values + np.array([0, 0, 1.4]) * track.times[:, None]
    moved = Track(track.node, track.path, track.interpolation, track.times, on)
    walking = Clip("", (*WALK.tracks[:hips], moved, *WALK.tracks[hips + 1 :]))
    root = traveling_root(SKELETON, walking)
    assert root == track.node
    found = judged(SCENE, walking, root=root)
    assert found.kind is LoopKind.CLOSED
    assert found.travel == pytest.approx(1.4, abs=1e-6)


def _lap(times: np.ndarray) -> np.ndarray:
    return times if len(times) == 1 else np.concatenate((times, times[1:] + 1.0))


def _again(track: Track) -> np.ndarray:
    values = track.values if len(track.times) == 1 else np.concatenate((track.values, track.values[1:]))
    return quaternion.align_signs(values) if track.path == "rotation" else values


def test_a_seam_without_a_corner_has_no_speed() -> None:
    smooth = spline(WALK, tangents=TANGENTS["natural"], cyclic=True)
    assert judged(SCENE, WALK).speed_seam > 0.1
    assert judged(SCENE, smooth).speed_seam < 0.01
