"""Chains of three joints on each other, by hand: where they point, when keys are added, and where paths begin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.errors import UnsupportedError
from anim.exchange.euler.curve import Curve, Mode, linear, uniform_modes
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.motion import EulerMotion, EulerNode
from anim.exchange.retarget.apply import apply_to_character
from anim.exchange.retarget.retarget import GroundMode
from anim.maths import quaternion
from anim.maths.euler import AxesConvention
from anim.model import Interpolation, Scene, TimeAxis, Track
from anim.sampling import frame_times, sample_pose, world_matrices
from anim.sampling.times import key_times
from anim.sampling.track import sample
from anim.sampling.world import world_rotations
from tests.anim.exchange.figures import tail


def test_other_chains_point_alike() -> None:
    times = np.array((0.0, 1.0))
    curve = linear(times, np.radians((0.0, 50.0)))
    nodes = tuple(
        EulerNode(
            f"Tail.{i + 1}",
            i - 1,
            np.array((2.0 * (i > 0), 0, 0)),
            "Z",
            AxesConvention.INTRINSIC,
            np.zeros(1),
            (curve,),
        )
        for i in range(3)
    )
    source = from_euler(EulerMotion(nodes), tolerance=1e-4)
    target = tail(quaternion.from_rotation_vector(np.array((0, 1.2, 0))))
    done = apply_to_character(source, Scene(target, ()), aliases={}, nested=True, floor=GroundMode.KEEP)
    one, two = (
        world_matrices(bones, sample_pose(bones, clip, np.array((0.5,))))[0, :, :, 3]
        for bones, clip in ((source.skeleton, source.clip), (target, done.clip))
    )
    np.testing.assert_allclose(np.diff(two, axis=0), np.diff(one, axis=0) / 2, atol=1e-6)
    assert done.scale == pytest.approx(0.5)


def _keyed(name: str, parent: int, *degrees: tuple[float, ...], mode: Mode = Mode.LINEAR) -> EulerNode:
    """A joint a metre out on x, keyed every two seconds on X, Y and Z."""
    curves = []
    for values in degrees:
        times = np.array([2.0 * key for key in range(len(values))])
        curves.append(Curve(TimeAxis(times), np.radians(values), uniform_modes(len(values), mode)))
    offset = np.array((float(parent >= 0), 0, 0))
    return EulerNode(name, parent, offset, "XYZ", AxesConvention.INTRINSIC, np.zeros(3), tuple(curves))


def test_keys_between_keys_keep_the_tolerance() -> None:
    """A joint between two matched ones turns too: what the outer one does in its new parent is no slerp."""
    tolerance = np.radians(0.1)
    nodes = (
        _keyed("tail1", -1, (0, 80, 0), (0, 30, 60), (0, -50, 0)),
        _keyed("other", 0, (0, -70, 40), (0, 20, 0), (10, 90, 0)),
        _keyed("tail2", 1, (0, 60, 0), (0, 0, 50), (0, 70, -170)),
        _keyed("tail3", 2, (0, 10, 0), (0, 0, 0), (0, 0, 10)),
    )
    source = from_euler(EulerMotion(nodes), tolerance=tolerance)
    target = tail(quaternion.from_rotation_vector(np.array((0, 0, 0.0))))
    clip = apply_to_character(source, Scene(target, ()), aliases={}, nested=True, floor=GroundMode.KEEP).clip
    joint, at = target.names.index("tail2"), np.linspace(0, 4, 3001)

    def wanted(times: Floats) -> Floats:
        turned = world_rotations(source.skeleton, sample_pose(source.skeleton, source.clip, times).rotation)
        return quaternion.multiply(quaternion.conjugate(turned[0]), turned[2])

    assert quaternion.angle_between(sample_pose(target, clip, at).rotation[:, joint], wanted(at)).max() < tolerance
    keys = np.unique(np.concatenate([track.times for track in source.clip.tracks]))
    without = Track(joint, "rotation", Interpolation.LINEAR, keys, quaternion.align_signs(wanted(keys)))
    assert quaternion.angle_between(sample(without, at), wanted(at)).max() > tolerance


def test_a_motion_of_days_is_not_looked_through_for_contacts() -> None:
    """It would take hours and all memory; heights can be scaled all the same."""
    days = np.array((0.0, 200_000.0))  # s
    turning = (linear(days, np.array((0.0, 1.0))),) * 3
    source = from_euler(EulerMotion((replace(_keyed("tail1", -1), rotation=turning),)), tolerance=1e-3)
    target = Scene(tail(np.array((0, 0, 0, 1.0))), ())
    with pytest.raises(UnsupportedError, match="the motion lasts 200000 s: too long"):
        apply_to_character(source, target, aliases={}, nested=True)
    clip = apply_to_character(source, target, aliases={}, nested=True, floor=GroundMode.KEEP).clip
    assert clip.end == days[1]


def test_steps_stay_steps() -> None:
    nodes = [_keyed("tail1", -1, (0, 80, 0), (0, 0, 0), (0, 0, 0), mode=Mode.STEP)]
    source = from_euler(EulerMotion(tuple(nodes)), tolerance=1e-3)
    clip = apply_to_character(
        source, Scene(tail(np.array((0, 0, 0, 1.0))), ()), aliases={}, nested=True, floor=GroundMode.KEEP
    ).clip
    turn = next(track for track in clip.tracks if track.path == "rotation")
    before, after = sample(turn, np.array((1.999, 2.001)))
    assert quaternion.angle_between(before, np.array((0, 0, 0, 1.0))) < 1e-6
    assert quaternion.angle_between(before, after) == pytest.approx(np.radians(80), abs=1e-6)


@pytest.mark.parametrize("fps", [24, 30, 60])
def test_steps_are_exact_at_frames(fps: int) -> None:
    """At times as files hold them."""
    times, figure = np.arange(7) / 24, tail(np.array((0, 0, 0, 1.0)))
    steps = linear(times, np.radians((0, 80, -40, 10, 10, 90, 0)))
    steps = replace(steps, modes=uniform_modes(len(times), Mode.STEP))
    node = replace(_keyed("tail1", -1), rotation=(steps, *[linear(times[:1], np.zeros(1))] * 2))
    source = from_euler(EulerMotion((node,)), tolerance=1e-3)
    clip = apply_to_character(source, Scene(figure, ()), aliases={}, nested=True, floor=GroundMode.KEEP).clip
    (before,), (after,) = ([t for t in each.tracks if t.path == "rotation"] for each in (source.clip, clip))
    assert before.interpolation is after.interpolation is Interpolation.STEP
    frames = key_times(frame_times(clip.start, clip.end, fps=fps))
    assert quaternion.angle_between(sample(before, frames), sample(after, frames)).max() < 1e-7


def test_the_path_begins_from_where_the_character_stands() -> None:
    """Both axes of the ground, so that a crowd does not gather in one place."""
    target = tail(np.array((0, 0, 0, 1.0)))
    aside = replace(target, translation=target.translation + (target.parents < 0)[:, None] * [3.0, 0, -2])
    source = from_euler(EulerMotion((_keyed("tail1", -1, (0, 80, 0), (0, 0, 0), (0, 0, 0)),)), tolerance=1e-3)
    here, there = (
        sample_pose(each, clip, np.zeros(1)).translation[0, 0]
        for each in (target, aside)
        for clip in [apply_to_character(source, Scene(each, ()), aliases={}, nested=True, floor=GroundMode.KEEP).clip]
    )
    np.testing.assert_allclose(there - here, (3, 0, -2), atol=1e-9)
