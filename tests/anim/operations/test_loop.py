"""Loops: what kind a clip is, and that closing it leaves no seam."""

from __future__ import annotations

import numpy as np
import pytest

import fixtures
from anim.curves.tangents.table import TANGENTS
from anim.errors import RangeError
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.measure.inspect.root_motion import root_motion_node
from anim.measure.loops.loop_analysis import analyze_loop as judged
from anim.measure.loops.loop_analysis import best_ranges
from anim.measure.loops.loop_kind import LoopKind
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip, Scene, Track
from anim.operations.loop import append_first_frame, loop
from anim.operations.spline import spline
from anim.operations.trim import trim
from anim.sampling.derivatives import rates
from anim.sampling.track import sample
from tests.anim.operations.tracks import TRACKS
from tests.clips import LINEAR, STEP, about, track
from tests.clips import clip as clip_of
from tests.files import opened


def _walk() -> tuple[Scene, Clip]:
    document = opened(fixtures.build("biped"))
    return reader.scene(document), next(clip for clip in reader.clips(document) if clip.name == "walk")


SCENE, WALK = _walk()
SKELETON = SCENE.skeleton
SKIN = SkinMotion(SCENE)


def test_the_walk_is_closed() -> None:
    assert judged(SKIN, WALK).kind is LoopKind.CLOSED


def test_without_its_last_frame_it_is_open_by_one() -> None:
    cut = trim(WALK, end=23 / 24)
    found = judged(SKIN, cut)
    assert found.kind is LoopKind.OPEN_BY_ONE_FRAME
    closed = append_first_frame(cut, fps=found.fps)
    assert closed.end == pytest.approx(1.0, abs=1e-6)
    assert judged(SKIN, closed).kind is LoopKind.CLOSED
    assert judged(SKIN, closed).seam < 1e-6


def test_a_root_travels_on_in_the_appended_frame() -> None:
    """It went back to its start within one frame."""
    times = np.arange(24) / 24
    ahead = np.stack((2 * times, 0.03 * np.sin(4 * np.pi * times), 0 * times), axis=1)
    clip = Clip("", (track("translation", times, ahead, LINEAR, node=0), track("translation", times, ahead, node=1)))
    root, other = append_first_frame(clip, fps=24, root=0).tracks
    np.testing.assert_allclose(root.values[-1], [2, 0, 0], atol=0.003)
    np.testing.assert_allclose(sample(root, np.array([23.5 / 24]))[0, 0], 2 * 23.5 / 24, atol=1e-9)
    np.testing.assert_array_equal(other.values[-1], other.values[0])
    spline_root = append_first_frame(spline(clip), fps=24, root=0).tracks[0]
    np.testing.assert_allclose(spline_root.values[-1], [2, 0, 0], atol=0.003)


def test_half_a_walk_is_no_loop() -> None:
    assert judged(SKIN, trim(WALK, end=0.5)).kind is LoopKind.NOT_A_LOOP


def test_blend_closes_it() -> None:
    half = trim(WALK, end=0.5)
    closed = loop(half, blend=0.25)
    assert judged(SKIN, closed).seam < 1e-9
    early = np.linspace(0, 0.24, 50)
    for old, new in zip(half.tracks, closed.tracks, strict=True):
        np.testing.assert_allclose(sample(new, early), sample(old, early), atol=1e-9)


@pytest.mark.parametrize("key", ["cubic", "turning", "linear", "slerp", "step"])
def test_ends_meet_in_value_and_splines_in_speed(key: str) -> None:
    new = loop(Clip("", (TRACKS[key],)), blend=1.0).tracks[0]
    first, last = sample(new, np.array([0.0, 3.0]))
    assert min(np.abs(first - last).max(), np.abs(first + last).max()) < 1e-9
    if key != "step":
        start, end = rates(new, np.array([0.0]), before=False), rates(new, np.array([3.0]), before=True)
        np.testing.assert_allclose(end, start, atol=0.05 * np.abs(start).max() if key == "turning" else 1e-9)


@pytest.mark.parametrize("count", [2, 9, 40])
@pytest.mark.parametrize("blend", [0.3, 1.0, 1.999995, 2.0])
def test_linear_tracks_end_at_the_speed_that_they_start_with(count: int, blend: float) -> None:
    """However few keys, or however many: the last piece goes on as the first one does."""
    times = np.linspace(0, 2, count)
    rise = track("translation", times, np.stack((times**2, np.sin(times), 0 * times), axis=1), LINEAR)
    turn = track("rotation", times, about("z", 80 * times**2), LINEAR)
    for new in loop(Clip("", (rise, turn)), blend=blend).tracks:
        start, end = rates(new, np.array([0.0]), before=False), rates(new, np.array([2.0]), before=True)
        np.testing.assert_allclose(end, start, atol=1e-6)


def test_a_blend_over_a_whole_clip_leaves_its_first_segment() -> None:
    times = np.array([0.0, 0.01, 0.04, 0.1])
    rise = track("translation", times, np.stack((times, 3 * times, 0 * times), axis=1), LINEAR)
    (new,) = loop(Clip("", (rise,)), blend=0.1).tracks
    before = np.linspace(0, new.times[1], 9)
    np.testing.assert_allclose(sample(new, before), sample(rise, before), atol=1e-12)


@pytest.mark.parametrize("held", [1.5, 1.999])
def test_a_gap_is_closed_over_the_whole_blend_where_a_pose_is_held_first(held: float) -> None:
    """The dense keys at the end are no reason to close it there alone: it would be a jump."""
    times = np.concatenate(([0.0], np.linspace(held, 2, 12)))
    rise = track("translation", times, np.outer(3 * times, [1.0, 0, 0]), LINEAR)
    (new,) = loop(Clip("", (rise,)), blend=2.0).tracks
    places = sample(new, np.linspace(0, 2, 2001))[:, 0]
    assert np.abs(np.diff(places)).max() / 1e-3 < 12
    np.testing.assert_allclose(places[-1], places[0], atol=1e-6)


def test_a_clip_too_short_for_a_key_in_the_blend_is_closed() -> None:
    short = track("translation", [0, 1.5e-5], np.array([[0.0, 0, 0], [1, 2, 3]]), LINEAR)
    (new,) = loop(Clip("", (short,)), blend=1.5e-5).tracks
    np.testing.assert_array_equal(new.values, 0)


def test_a_track_that_starts_late_rests_at_the_seam() -> None:
    late = track("translation", [0.5, 1.5], np.array([[3.0, 0, 0], [5, 0, 0]]), LINEAR, node=0)
    other = track("translation", [0, 2], np.zeros((2, 3)), LINEAR, node=1)
    new = loop(Clip("", (late, other)), blend=0.3).tracks[0]
    np.testing.assert_allclose(rates(new, np.array([2.0]), before=True), 0, atol=1e-9)
    assert np.diff(sample(new, np.linspace(1.7, 2, 100))[:, 0]).max() < 1e-12


def test_keys_that_jump_before_the_blend_stay() -> None:
    jump = track("translation", [0, 0.5, 0.5 + 2.0**-22, 2], np.array([[0.0, 0, 0], [0, 0, 0], [1, 0, 0], [2, 0, 0]]))
    new = loop(Clip("", (jump,)), blend=0.5).tracks[0]
    np.testing.assert_array_equal(new.times[:3], jump.times[:3])


def test_a_jump_in_the_last_moment_goes() -> None:
    jump = track("translation", [0, 2 - 2.0**-22, 2], np.array([[0.0, 0, 0], [0, 0, 0], [1, 0, 0]]), LINEAR)
    new = loop(Clip("", (jump,)), blend=0.5).tracks[0]
    np.testing.assert_allclose(new.values, 0, atol=1e-9)


@pytest.mark.parametrize("key", ["cubic", "turning", "linear", "slerp", "step"])
def test_a_late_clip_gets_keys_that_float32_tells_apart(key: str) -> None:
    late = TRACKS[key].with_keys(
        7200 + TRACKS[key].times,
        TRACKS[key].values,
        TRACKS[key].in_tangents,
        TRACKS[key].out_tangents,
    )
    for blend in (0.0101, 0.3, 1.75, 1.7501):  # the last starts 0.1 ms before a key, where float32 steps are 0.5 ms
        times = loop(Clip("", (late,)), blend=blend).tracks[0].times.astype(np.float32)
        assert (np.diff(times) > 0).all()


def test_blend_longer_than_the_clip_is_refused() -> None:
    with pytest.raises(RangeError, match="blend"):
        loop(WALK, blend=1.5)


@pytest.mark.parametrize("start", [0.0, 40.0])
def test_a_blend_as_long_as_the_clip_is_taken_in_spite_of_float32(start: float) -> None:
    times = np.array([0.0, 0.4, 1.3]) + start
    moved = clip_of(
        track("translation", times.astype(np.float32).astype(np.float64), [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    )
    assert moved.end - moved.start < 1.3
    (new,) = loop(moved, blend=1.3).tracks
    np.testing.assert_allclose(new.values[-1], new.values[0], atol=1e-12)
    assert new.times[0] == moved.start
    with pytest.raises(RangeError, match="`blend` is 1"):
        loop(moved, blend=1.301)


def test_the_best_part_of_two_walks_is_one_walk() -> None:
    twice = Clip("", tuple(Track(t.node, t.path, t.interpolation, _lap(t.times), _again(t)) for t in WALK.tracks))
    best = best_ranges(SKIN, twice, shortest=0.8)[0]
    assert best.end - best.start == pytest.approx(1.0, abs=1e-3)
    assert best.seam < 1e-4


def test_a_root_that_walks_on_travels_and_one_that_sways_does_not() -> None:
    assert root_motion_node(SKELETON, WALK) == -1
    hips = next(i for i, t in enumerate(WALK.tracks) if t.path == "translation")
    track = WALK.tracks[hips]
    on = track.values + np.array([0, 0, 1.4]) * track.times[:, None]
    moved = Track(track.node, track.path, track.interpolation, track.times, on)
    walking = Clip("", (*WALK.tracks[:hips], moved, *WALK.tracks[hips + 1 :]))
    root = root_motion_node(SKELETON, walking)
    assert root == track.node
    found = judged(SKIN, walking, root=root)
    assert found.kind is LoopKind.CLOSED
    assert found.travel == pytest.approx(1.4, abs=1e-6)


def _lap(times: np.ndarray) -> np.ndarray:
    return times if len(times) == 1 else np.concatenate((times, times[1:] + 1.0))


def _again(track: Track) -> np.ndarray:
    values = track.values if len(track.times) == 1 else np.concatenate((track.values, track.values[1:]))
    return quaternion.align_signs(values) if track.path == "rotation" else values


def test_a_seam_without_a_corner_has_no_speed() -> None:
    smooth = spline(WALK, tangents=TANGENTS["natural"], cyclic=True)
    assert judged(SKIN, WALK).speed_seam > 0.1
    assert judged(SKIN, smooth).speed_seam < 0.01


@pytest.mark.parametrize("key", [key for key in TRACKS if "short" not in key])
def test_a_blend_leaves_what_is_before_it(key: str) -> None:
    """Tangents of rotation splines with a part along the quaternion, or over the long arc, were replaced."""
    track = TRACKS[key]
    new = loop(Clip("", (track,)), blend=0.4).tracks[0]
    before = np.linspace(0, 2.6, 997)
    a, b = sample(track, before), sample(new, before)
    if track.path == "rotation":
        assert float(np.degrees(quaternion.angle_between(a, b)).max()) < 0.0011
    else:
        np.testing.assert_allclose(a, b, atol=1e-12)


def test_a_wheel_turns_on_in_the_appended_frame() -> None:
    """Its last key is in the other hemisphere than its first one, whose tangent needs the sign of the new key."""
    angles = np.radians(30 * np.arange(12))
    keys = np.stack((np.sin(angles / 2), 0 * angles, 0 * angles, np.cos(angles / 2)), axis=1)
    wheel = spline(Clip("", (track("rotation", np.arange(12) / 12, keys, LINEAR),)), tangents="time-aware")
    closed = append_first_frame(wheel, fps=12).tracks[0]
    half = np.radians(345) / 2
    shown = sample(closed, np.array([11.5 / 12]))[0]
    np.testing.assert_allclose(np.abs(shown @ [np.sin(half), 0, 0, np.cos(half)]), 1, atol=1e-6)


def test_step_tracks_that_end_early_keep_their_last_value_until_the_end() -> None:
    held = track("translation", [0, 0.25, 0.5], np.outer([0, 1, 2], [1, 0, 0]), STEP)
    closed = track("scale", [0, 0.25, 0.5], np.outer([1, 2, 1], [1, 1, 1]), STEP)
    last = track("translation", [0, 1], np.outer([0, 3], [1, 0, 0]), STEP, node=1)
    clip = loop(clip_of(held, closed, last), blend=0.2)
    assert clip.tracks[0].times.tolist() == [0, 0.25, 0.5, 1]
    assert clip.tracks[0].values[:, 0].tolist() == [0, 1, 2, 0]
    assert clip.tracks[1].times.tolist() == [0, 0.25, 0.5]
    assert clip.tracks[2].values[:, 0].tolist() == [0, 0]
