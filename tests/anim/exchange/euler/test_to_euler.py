"""Curves out of glTF clips, and BVH there and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.arrays import Floats
from anim.errors import RangeError
from anim.exchange.euler.curve import Mode
from anim.exchange.euler.evaluate import evaluate_rotation, rest_positions
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.motion import Convention, EulerMotion, Unit, scale_motion
from anim.exchange.euler.to_bvh_motion import to_bvh
from anim.exchange.euler.to_euler import to_euler
from anim.exchange.formats import bvh_reader
from anim.gltf import authoring
from anim.gltf.reading import reader
from anim.maths import euler, quaternion
from anim.maths.euler import ORDERS, AxesConvention
from anim.model import Clip, Interpolation, Skeleton, Track
from anim.sampling import sample_pose, world_matrices
from anim.sampling.track import sample
from tests.clips import skeleton
from tests.files import glb_of, opened, opened_fixture, opened_path

BVH = Convention("ZXY", AxesConvention.INTRINSIC, Unit.DEG)
AT = np.ones((20, 3))
ONE = Skeleton(("a",), np.array([-1]), np.zeros((1, 3)), np.array([[0, 0, 0, 1.0]]), np.ones((1, 3)))


def _values(motion: EulerMotion, node: int = 0) -> Floats:
    return np.stack([curve.values for curve in motion.nodes[node].rotation if curve is not None], axis=-1)


def _turning(seed: int = 3) -> Clip:
    random = np.random.default_rng(seed)
    q = quaternion.align_signs(quaternion.normalize(random.normal(size=(20, 4))))
    return Clip("c", (Track(0, "rotation", Interpolation.LINEAR, np.arange(20.0), q),))


@pytest.mark.parametrize("frame", AxesConvention)
@pytest.mark.parametrize("order", ORDERS)
def test_curves_are_the_rotation_at_every_key(order: str, frame: AxesConvention) -> None:
    clip = _turning()
    found = to_euler(ONE, clip, order=order, frame=frame)
    made = evaluate_rotation(found.motion.nodes[0], clip.tracks[0].times)
    assert quaternion.angle_between(made, clip.tracks[0].values).max() < 1e-6
    assert np.abs(np.diff(_values(found.motion), axis=0)).max() < 1.5 * np.pi


def test_steps_keep_their_times_under_a_frame_rate() -> None:
    turns = quaternion.from_rotation_vector(np.array([[0, 0, 0], [0, 0, 1.0]]))
    steps: tuple[Track, ...] = (Track(0, "rotation", Interpolation.STEP, np.array((0.0, 0.35)), turns),)
    steps += (Track(0, "scale", Interpolation.STEP, np.array((0.0, 0.35)), np.ones((2, 3))),)
    (node,) = to_euler(ONE, Clip("c", steps), order="XYZ", fps=4).motion.nodes
    for curve in (*node.rotation, *node.scales.values()):
        assert curve is not None
        assert curve.times.tolist() == [0, 0.35]
        assert set(curve.modes.tolist()) == {Mode.STEP}


def test_keys_are_added_until_straight_curves_follow() -> None:
    clip = _turning()
    coarse, fine = to_euler(ONE, clip, order="XYZ"), to_euler(ONE, clip, order="XYZ", tolerance=0.01)
    at = np.linspace(0, 19, 5001)
    off = quaternion.angle_between(evaluate_rotation(fine.motion.nodes[0], at), sample(clip.tracks[0], at)).max()
    assert off < 0.0101
    assert fine.deviation <= 0.01 < coarse.deviation


def test_a_jump_is_no_deviation() -> None:
    """A quarter turn between two neighboring float32 times, as steps become: nothing is ever shown between them."""
    jump = float(np.nextafter(np.float32(1), np.float32(0)))
    turns = quaternion.from_rotation_vector(np.array([[0, 0, 0], [0, 0, 0.1], [0.9, 0.9, 0], [0.9, 0.9, 0.1]]))
    clip = Clip("c", (Track(0, "rotation", Interpolation.LINEAR, np.array([0, jump, 1, 2]), turns),))
    assert to_euler(ONE, clip, order="XYZ", tolerance=1e-3).deviation <= 1e-3


def test_there_and_back_is_the_same_clip() -> None:
    document = opened_fixture("biped")
    skeleton, clips = reader.skeleton(document), reader.clips(document)
    walk = next(clip for clip in clips if clip.name == "walk")
    motion = to_euler(skeleton, walk, order="YZX", frame=AxesConvention.EXTRINSIC).motion
    back = from_euler(motion, tolerance=1e-3)
    assert back.skeleton.names == skeleton.names
    np.testing.assert_allclose(rest_positions(back.skeleton), rest_positions(skeleton), atol=1e-9)
    before, after = (sample_pose(skeleton, clip, walk.tracks[0].times) for clip in (walk, back.clip))
    np.testing.assert_allclose(after.translation, before.translation, atol=1e-6)
    assert quaternion.angle_between(after.rotation, before.rotation).max() < 1e-6


@pytest.mark.parametrize("name", ["cmu_01_01.bvh", "freebvh.bvh", "example.bvh"])
def test_bvh_there_and_back(name: str, asset: Callable[[str], Path]) -> None:
    """Angles within 1e-4° of the source's, as rotations always, as numbers (up to whole turns) away from lock."""
    first = bvh_reader.read(asset(f"bvh/{name}").read_bytes())
    converted = from_euler(scale_motion(first, 0.05), tolerance=1e-3)
    document = opened(glb_of(authoring.build_document(converted.skeleton, [converted.clip])))
    order = first.nodes[0].order
    motion = to_bvh(reader.skeleton(document), reader.clips(document)[0], order=order, meters_per_unit=0.05)
    second = bvh_reader.read(bvh_reader.write(motion, BVH))
    assert [n.name for n in second.nodes if not n.end] == [n.name for n in first.nodes if not n.end]
    assert [n.end for n in second.nodes] == [n.end for n in first.nodes]
    for one, two in zip(first.nodes, second.nodes, strict=True):
        np.testing.assert_allclose(two.translation, one.translation, atol=2e-5)
        if one.end:
            continue
        times = one.rotation[0].times if one.rotation[0] is not None else np.zeros(1)
        q, p = evaluate_rotation(one, times), evaluate_rotation(two, times)
        assert np.degrees(quaternion.angle_between(q, p).max()) < 1e-4
        a, b = (np.degrees(np.stack([c.values for c in n.rotation if c is not None], axis=-1)) for n in (one, two))
        free = np.degrees(euler.gimbal_distance(q, order=order)) > 10
        same = np.abs(np.mod(b - a + 180, 360) - 180).max(axis=-1)
        other = np.abs(np.mod(b - (a * [1, -1, 1] + 180) + 180, 360) - 180).max(axis=-1)
        assert np.minimum(same, other)[free].max(initial=0) < 1e-4


@pytest.mark.parametrize("name", ["CesiumMan.glb", "Fox.glb", "Knight.glb"])
def test_a_bvh_of_any_skeleton_puts_joints_where_they_are(name: str, asset: Callable[[str], Path]) -> None:
    document = opened_path(asset(name))
    skeleton, clip = reader.skeleton(document), reader.clips(document)[0]
    joints = {joint for skin in document.json["skins"] for joint in skin["joints"]}
    motion = to_bvh(skeleton, clip, order="ZXY", fps=30, joints=joints)
    back = from_euler(bvh_reader.read(bvh_reader.write(motion, BVH)), tolerance=1e-3)
    times = clip.start + np.arange(int((clip.end - clip.start) * 30)) / 30
    expected = world_matrices(skeleton, sample_pose(skeleton, clip, times))[..., 3]
    found = world_matrices(back.skeleton, sample_pose(back.skeleton, back.clip, times - clip.start))[..., 3]
    size = float(np.ptp(expected[0], axis=0).max())
    for number, label in enumerate(back.skeleton.names):
        if number not in back.ends:
            assert np.abs(found[:, number] - expected[:, skeleton.names.index(label)]).max() < 1e-4 * size


def test_uneven_keys_want_a_frame_rate() -> None:
    times = np.array((0.0, 0.1, 0.5))
    clip = Clip("c", (Track(0, "rotation", Interpolation.LINEAR, times, np.tile((0, 0, 0, 1.0), (3, 1))),))
    with pytest.raises(RangeError, match="not evenly spaced"):
        to_bvh(ONE, clip, order="XYZ")
    assert len(to_bvh(ONE, clip, order="XYZ", fps=10).nodes[0].moves[0].times) == 6


def test_what_has_no_place_is_named() -> None:
    clip = Clip("c", (Track(0, "weights", Interpolation.LINEAR, np.zeros(1), np.zeros((1, 2))),))
    assert to_euler(ONE, clip, order="XYZ").motion.notes == ("left out: weights of 'a'",)


def test_what_lies_between_chosen_joints_is_written_too() -> None:
    chain = Skeleton(
        ("a", "b", "c", "d"), np.arange(-1, 3), np.ones((4, 3)), np.tile((0, 0, 0, 1.0), (4, 1)), np.ones((4, 3))
    )
    motion = to_bvh(chain, _turning(), order="ZXY", joints={0, 2})
    assert [(node.name, node.parent) for node in motion.nodes] == [("a", -1), ("b", 0), ("c", 1)]


def test_what_a_bvh_of_chosen_joints_does_not_show_is_named() -> None:
    """Motion above the joints moves them; motion beside and below is lost."""
    turn = _turning().tracks[0]
    tracks = (turn, replace(turn, node=1), replace(turn, node=2), replace(turn, node=3, path="translation", values=AT))
    bones = skeleton([-1, 0, 1, 0])
    assert to_bvh(bones, Clip("c", tracks), order="ZXY", joints={1}).notes == (
        "left out: rotation of '2', translation of '3'",
    )


def test_a_bvh_holds_names_between_braces_as_well_as_it_can() -> None:
    bones = replace(skeleton([-1, 0, 0]), names=("a{b}", "a(b)", "half \ud83d"))
    motion = to_bvh(bones, _turning(), order="ZXY")
    assert motion.notes == ("braces in names became parentheses: a(b)",)
    text = bvh_reader.write(motion, Convention("ZXY", AxesConvention.INTRINSIC, Unit.DEG))
    found = [node.name for node in bvh_reader.read(text).nodes if not node.end]
    assert found == ["a(b)", "a(b).2", "half \\ud83d"]


def test_offsets_of_a_bvh_keep_their_digits() -> None:
    offsets = [[0, 0, 0], [1234567, -2.5, 0.1234564], [0, 0, -1e-9]]
    motion = to_bvh(skeleton([-1, 0, 1], translation=offsets), _turning(), order="ZXY")
    text = bvh_reader.write(motion, Convention("ZXY", AxesConvention.INTRINSIC, Unit.DEG)).decode()
    assert "OFFSET 1234567 -2.500000 0.123456\n" in text
    assert text.count("OFFSET 0 0 0\n") == 3  # root, the last, and its End Site


def test_frames_on_keys_take_the_keys_values() -> None:
    """Float32 keys lie a little before or behind k / 30; a step must not come a frame late."""
    times = (np.arange(40, dtype=np.float32) / np.float32(30)).astype(np.float64)
    turns = quaternion.from_rotation_vector(np.arange(40)[:, None] * [0, 0, 0.05])
    clip = Clip("c", (Track(0, "rotation", Interpolation.STEP, times, turns),))
    motion = to_bvh(ONE, clip, order="ZXY", fps=30)
    np.testing.assert_allclose(_values(motion)[:, 0], np.arange(40) * 0.05, atol=1e-9)
