"""Seams on the skin: closed forms of small scenes, and the joints that make them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

import fixtures
from anim.gltf.reading import reader
from anim.maths import matrix, quaternion
from anim.measure.loops import skin_motion
from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.loop_analysis import analyze_loop
from anim.measure.loops.loop_kind import LoopKind
from anim.measure.loops.seam import measure_seams
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Interpolation, Scene
from anim.sampling import sample_pose, world_matrices
from anim.skinning.bake import bake
from tests.anim.measure.loops.chains import AT, CHAIN, FPS, SWING, chain, swinging
from tests.anim.skinning.scenes import looped, random_scene
from tests.clips import LINEAR, STEP, about, clip, track
from tests.files import opened


def test_a_swing_that_comes_back_is_closed() -> None:
    found = analyze_loop(SkinMotion(CHAIN), swinging())
    assert (found.kind, found.seam, found.joints) == (LoopKind.CLOSED, 0.0, ())


def test_a_joint_that_stays_open_is_named_with_its_own_gap() -> None:
    """Joint 1 is 5° off, with vertices at 0.5 m and 1.5 m from it: 2 r sin(θ/2), and nothing of the joints around."""
    found = analyze_loop(SkinMotion(CHAIN), swinging(j1=5))
    assert found.kind is LoopKind.CLOSED_EXCEPT
    assert [each.joint for each in found.joints] == ["1"]
    assert found.joints[0].gap == pytest.approx(3 * np.sin(np.radians(2.5)))
    assert found.seam == pytest.approx(3 * np.sin(np.radians(2.5)))
    assert found.node == "1"


def test_gaps_that_reach_further_than_the_motion_are_no_loop() -> None:
    assert analyze_loop(SkinMotion(CHAIN), swinging(j1=150)).kind is LoopKind.NOT_A_LOOP


def test_all_joints_one_frame_short_are_open_by_one_frame() -> None:
    whole = swinging()
    short = clip(*(each.with_keys(each.times[:-1], each.values[:-1]) for each in whole.tracks))
    found = analyze_loop(SkinMotion(CHAIN), short)
    assert found.kind is LoopKind.OPEN_BY_ONE_FRAME
    assert len(found.joints) == 3


def test_a_control_that_moves_no_vertex_does_not_count() -> None:
    control = track("translation", [0, 1], [[0, 5, 0], [7, 5, 0]], node=3)
    found = analyze_loop(SkinMotion(CHAIN), clip(*swinging().tracks, control))
    assert (found.kind, found.seam) == (LoopKind.CLOSED, 0.0)
    without = Scene(CHAIN.skeleton, ())  # no vertices anywhere: then all nodes count
    assert analyze_loop(SkinMotion(without), clip(*swinging().tracks, control)).kind is LoopKind.NOT_A_LOOP


def test_a_turn_that_comes_back_with_the_other_sign_is_closed() -> None:
    around = track("rotation", AT, np.r_[about("z", 36.0 * np.arange(10)), -about("z", [0.0])], node=0)
    found = analyze_loop(SkinMotion(CHAIN), clip(around, *swinging().tracks[1:]))
    assert (found.kind, found.joints) == (LoopKind.CLOSED, ())


def test_a_seam_below_the_usual_motion_is_closed() -> None:
    """A tenth of the usual motion from frame to frame is not seen, but a thousandth of the size at most."""
    found = analyze_loop(SkinMotion(CHAIN), swinging(j2=0.01))
    assert 0 < found.seam < 0.1 * found.inside.typical
    assert found.kind is LoopKind.CLOSED
    slow = clip(*(replace(each, values=about("z", 1e-3 * SWING) * [1, 1, 1, 1]) for each in swinging().tracks[:2]))
    jump = track("rotation", AT, about("z", np.r_[1e-3 * SWING[:10], 0.01]), node=2)
    assert analyze_loop(SkinMotion(CHAIN), clip(*slow.tracks, jump)).kind is not LoopKind.CLOSED


def test_morph_weights_that_stay_open_are_named() -> None:
    """A target of 0.2 m, at half weight in the end."""
    scene = chain([0, 0.2, 0])
    smile = track("weights", AT, np.r_[np.zeros(10), 0.5][:, None], node=2)
    found = analyze_loop(SkinMotion(scene), clip(*swinging().tracks, smile))
    assert found.kind is LoopKind.CLOSED_EXCEPT
    assert [(each.joint, each.is_morph) for each in found.joints] == [("2", True)]
    assert found.joints[0].gap == pytest.approx(0.1)


def test_steps_inside_are_those_of_the_vertices() -> None:
    """One vertex that turns evenly by 36° a frame, 0.5 m off its axis: the chord, and no change of speed."""
    scene = Scene(CHAIN.skeleton, CHAIN.instances[:1])
    around = clip(track("rotation", AT, about("z", 36.0 * np.arange(11)), node=0))
    found = analyze_loop(SkinMotion(scene), around).inside
    chord = 2 * 0.5 * np.sin(np.radians(18))
    assert (found.largest, found.typical) == pytest.approx((chord, chord))
    turn = np.radians(36) * FPS  # rad/s
    assert found.speed == pytest.approx(0.5 * turn**2 * 2e-4, rel=0.6)  # of the arc, over the time that is looked at


def test_a_corner_inside_is_measured_as_one_at_the_seam() -> None:
    """Up at 2 m/s and down again: the same corner in the middle and where the loop meets."""
    up_and_down = clip(track("translation", [0, 1, 2], np.array([[0, 0, 0], [0, 2.0, 0], [0, 0, 0]]), node=0))
    found = analyze_loop(SkinMotion(CHAIN), up_and_down)
    assert found.inside.speed == pytest.approx(4.0)
    assert found.speed_seam == pytest.approx(4.0)


@pytest.mark.parametrize("interpolation", [STEP, LINEAR])
def test_a_jump_inside_is_no_speed(interpolation: Interpolation) -> None:
    values = np.array([[0, 0, 0], [0, 0, 0], [0, 1, 0], [0, 1, 0]])
    jump = track("translation", [0, 1, 1 + 2.0**-23, 2], values, interpolation, node=0)
    assert analyze_loop(SkinMotion(CHAIN), clip(jump)).inside.speed == pytest.approx(0.0, abs=1e-9)


def test_the_seam_is_that_of_a_plain_loop_over_vertices() -> None:
    scene = random_scene(5, joints=5, vertices=60)
    turn = clip(*(track("rotation", [0, 1], about("x", [0, 10.0 * n]), node=n) for n in range(1, 4)))
    (instance,) = scene.instances
    assert instance.skin is not None
    world = world_matrices(scene.skeleton, sample_pose(scene.skeleton, turn, np.array([0.0, 1.0])))[
        :, instance.skin.joints
    ]
    bind = np.concatenate((instance.skin.inverse_bind, np.tile([[[0.0, 0, 0, 1]]], (5, 1, 1))), axis=1)
    bound = world @ bind
    mesh = instance.mesh
    first, end = looped(mesh.positions, mesh.joints, mesh.weights, bound)
    expected = np.linalg.norm(end - first, axis=1).max()
    (found,) = measure_seams(SkinMotion(scene), [LoopRange(turn, 0.0, 1.0)])
    assert found.gap == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("name", ["arm", "tube", "biped", "morph_cube"])
def test_the_seam_is_how_far_a_bake_ends_from_its_start(name: str) -> None:
    document = opened(fixtures.build(name))
    scene = reader.scene(document)
    for each in reader.clips(document):
        first, last = bake(scene, each, times=np.array([each.start, each.end]), rigid=True).load_all().positions
        assert analyze_loop(SkinMotion(scene), each).seam == pytest.approx(
            np.linalg.norm(last - first, axis=1).max(), rel=1e-5, abs=1e-6
        )


@pytest.mark.parametrize("name", ["arm", "biped", "morph_cube"])
def test_steps_inside_are_those_of_a_bake(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of every vertex, skinned and morphed, whatever the number of frames that are looked at together."""
    monkeypatch.setattr(skin_motion, "MAX_BATCH_VALUES", 20_000)
    document = opened(fixtures.build(name))
    scene = reader.scene(document)
    for each in reader.clips(document):
        found = analyze_loop(SkinMotion(scene), each)
        step = min(1 / found.fps, (each.end - each.start) / 2)
        count = max(round((each.end - each.start) / step), 2)
        times = np.minimum(each.start + step * np.arange(count + 1), each.end)
        places = bake(scene, each, times=times, rigid=True).load_all().positions.astype(float)
        moves = np.linalg.norm(np.diff(places, axis=0), axis=2).max(axis=1)
        assert found.inside.largest == pytest.approx(moves.max(), rel=1e-5, abs=1e-6)


def test_seams_of_a_bent_tube_are_closed_forms() -> None:
    """The end of a tube, bent at 90°: √2 times as far as its farthest vertex is from the elbow's axis."""
    document = opened(fixtures.build("tube"))
    scene = reader.scene(document)
    bend = next(each for each in reader.clips(document) if each.name == "bend90")
    (instance,) = scene.instances
    (elbow,) = (t.node for t in bend.tracks)
    assert instance.skin is not None
    assert elbow is not None
    (upper,) = np.flatnonzero(instance.skin.joints == elbow)
    carried = ((instance.mesh.joints == upper) * instance.mesh.weights).sum(axis=1) == 1
    axis = quaternion.rotation_vector(bend.tracks[0].values[-1])
    from_elbow = matrix.apply(instance.skin.inverse_bind[upper], instance.mesh.positions[carried])
    off = np.linalg.norm(np.cross(from_elbow, axis / np.linalg.norm(axis)), axis=1).max()
    found = analyze_loop(SkinMotion(scene), bend)
    assert found.seam == pytest.approx(np.sqrt(2) * off, rel=1e-5)
    assert found.speed_seam == pytest.approx(np.sqrt(2) * np.pi / 2 * off, rel=1e-3)


@pytest.mark.parametrize("late", [0.0, 5e-5, 1e-7])
def test_a_step_is_a_gap_and_no_speed(late: float) -> None:
    """Joint 0 turns on by 0.2 rad/s, 2.5 m from the end; a STEP track jumps in the last or in the first moment."""
    turn = track("rotation", [0, 1], about("z", [0, np.degrees(0.2)]), node=0)
    values = np.array([[1.0, 0, 0]] * 2 + [[1, 0.05, 0]])
    jump = track("translation", [0, 0.5, 1 - late], values, STEP, node=2)
    found = analyze_loop(SkinMotion(CHAIN), clip(turn, jump))
    still = analyze_loop(SkinMotion(CHAIN), clip(turn))
    assert found.speed_seam == pytest.approx(still.speed_seam, abs=0.2 * 0.05)
    assert still.speed_seam == pytest.approx(2 * np.sin(0.1) * 0.2 * 2.5, rel=1e-3)
    assert found.joints[-1].gap == pytest.approx(0.05)
    first = track("translation", [0, late + 1e-9, 1], np.array([[1, 0.05, 0], [1, 0, 0], [1, 0, 0]]), STEP, node=2)
    assert analyze_loop(SkinMotion(CHAIN), clip(turn, first)).speed_seam == pytest.approx(
        still.speed_seam, abs=0.2 * 0.05
    )


def test_two_keys_in_one_moment_are_a_step_too() -> None:
    values = np.zeros((4, 3))
    values[-1, 1] = 0.05
    pair = track("translation", [0, 0.5, 1 - 2.0**-24, 1], values, node=0)
    found = analyze_loop(SkinMotion(CHAIN), clip(pair))
    assert (found.speed_seam, found.node) == (0.0, "0")
    assert found.seam == pytest.approx(0.05)
    closed = track("translation", [0, 0.5, 1], np.array([[0, 0, 0], [0, 1, 0], [0, 0, 0]]), STEP, node=0)
    found = analyze_loop(SkinMotion(CHAIN), clip(closed))
    assert (found.kind, found.seam, found.speed_seam, found.node) == (LoopKind.CLOSED, 0.0, 0.0, "")


def test_a_jump_at_the_end_counts() -> None:
    """STEP: the last key is shown for no time, but players that stop there show it."""
    stepped = track("translation", AT, np.r_[np.zeros((10, 3)), [[0, 0.05, 0]]], STEP, node=1)
    found = analyze_loop(SkinMotion(CHAIN), clip(*swinging().tracks, stepped))
    assert found.kind is LoopKind.CLOSED_EXCEPT
    assert [each.gap for each in found.joints] == [pytest.approx(0.05)]


@pytest.mark.parametrize("targets", [None, [0.0, 1, 0]])
def test_gap_and_speed_are_the_same_without_motion_per_frame(targets: ArrayLike | None) -> None:
    drifting = swinging(j1=3.0)
    skin = SkinMotion(chain(targets))
    whole = LoopRange(drifting, drifting.start, drifting.end)
    (alone,) = measure_seams(skin, [whole])
    both = measure_seams(skin, [whole, whole._replace(frame=1 / FPS)])
    assert both[0] == pytest.approx(alone)
    assert (alone.gap, alone.speed, alone.fastest) == pytest.approx((both[1].gap, both[1].speed, both[1].fastest))
    assert (alone.frame, alone.going_on) == (0.0, alone.gap)
    assert both[1].frame > 0


def test_steps_are_those_of_the_stated_rate() -> None:
    """A vertex half a metre from the axis at 90°/s: sin(θ/2) m per frame, whatever the spacing of the keys."""
    turn = clip(track("rotation", [0.0, 1.0], about("z", [0, 90]), node=2))
    for fps in (10, 24, 90):
        found = analyze_loop(SkinMotion(CHAIN), turn, fps=fps)
        assert found.fps == fps
        assert found.inside.largest == pytest.approx(np.sin(np.radians(45 / fps)), rel=1e-5)
    assert analyze_loop(SkinMotion(CHAIN), turn).fps == 30, "of keys that are not regular"
