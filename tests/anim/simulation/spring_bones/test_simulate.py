"""Clips with simulated springs: tracks, timing, loops, determinism."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from anim.errors import RangeError
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.maths import quaternion
from anim.model import Clip
from anim.sampling.track import sample
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, SpringParameters
from anim.simulation.spring_bones.read import read_spring_bones
from anim.simulation.spring_bones.simulate import SpringOptions, simulate_springs
from tests.anim.simulation.spring_bones.swaying import BONES, CHAIN, DOWN, ONE, swaying
from tests.clips import about, track
from tests.files import glb_of, opened, opened_fixture
from tests.khronos import errors, needs_validator, validate


def test_joints_get_rotation_tracks_after_the_others() -> None:
    result = simulate_springs(CHAIN, swaying(), BONES)
    assert [track.target for track in result.clip.tracks] == [(0, "rotation"), (1, "rotation"), (2, "rotation")]
    assert result.clip.tracks[0] is swaying().tracks[0] or result.clip.tracks[0] == swaying().tracks[0]
    assert result.clip.name == "sway"
    assert result.num_steps == 60
    assert len(result.clip.tracks[1].times) == 61
    assert 0.1 < result.max_rotation < 3
    assert result.max_speed > 0.1


def test_tracks_of_joints_are_replaced_where_they_are() -> None:
    own = track("rotation", [0, 1], about("x", [0, 50]), node=2)
    lift = track("translation", [0, 1], [DOWN, [0, -0.3, 0]], node=2)
    result = simulate_springs(CHAIN, Clip("", (own, lift, *swaying().tracks)), BONES)
    assert result.replaced == (2,)
    assert [track.target[0] for track in result.clip.tracks] == [2, 2, 0, 1]
    assert result.clip.tracks[1] == lift
    np.testing.assert_array_equal(
        result.clip.tracks[0].values,
        simulate_springs(CHAIN, Clip("", (lift, *swaying().tracks)), BONES).clip.tracks[-1].values,
    )


def test_the_driver_is_evaluated_at_every_step() -> None:
    """A driver with two keys moves evenly: the chain does as with a key at every step."""
    sparse = Clip("", (track("translation", [0, 1], [[0, 0, 0], [3, 0, 0]]),))
    times = np.arange(61) / 60
    dense = Clip("", (track("translation", times, np.outer(times, [3, 0, 0])),))
    few, many = (simulate_springs(CHAIN, clip, BONES).clip.tracks[1].values for clip in (sparse, dense))
    np.testing.assert_allclose(few, many, atol=1e-12)


def test_output_frames_are_samples_of_the_steps() -> None:
    steps = simulate_springs(CHAIN, swaying(), BONES).clip.tracks[1]
    frames = simulate_springs(CHAIN, swaying(), BONES, SpringOptions(fps=24)).clip.tracks[1]
    np.testing.assert_allclose(frames.times, np.arange(25) / 24, atol=1e-7)
    assert quaternion.angle_between(frames.values, sample(steps, frames.times)).max() < 1e-6


def test_a_duration_that_is_no_multiple_of_the_step_has_an_exact_end() -> None:
    result = simulate_springs(CHAIN, swaying(), BONES, SpringOptions(duration=0.99))
    assert result.num_steps == 60
    assert result.clip.tracks[1].times[-1] == np.float32(0.99)
    long = simulate_springs(CHAIN, swaying(), BONES, SpringOptions(duration=2.0))
    assert long.clip.end == 2.0
    np.testing.assert_array_equal(
        long.clip.tracks[1].values[:61], simulate_springs(CHAIN, swaying(), BONES).clip.tracks[1].values
    )


def test_warm_up_settles_at_the_first_pose() -> None:
    bent = Clip("", (track("rotation", [0, 1], about("z", [60, 60])),))
    cold, warm = (
        simulate_springs(CHAIN, bent, BONES, SpringOptions(warm_up=seconds)).clip.tracks[1].values
        for seconds in (0.0, 20.0)
    )
    assert quaternion.angle_between(cold[:1], cold[-1:])[0] > 0.1
    assert quaternion.angle_between(warm[:1], warm[-1:])[0] < 1e-6


def test_a_loop_is_closed_and_plays_on() -> None:
    result = simulate_springs(CHAIN, swaying(), BONES, SpringOptions(loop=True))
    assert result.loop is not None
    assert result.loop.settled
    assert 2 <= result.loop.rounds < 20
    assert result.loop.seam < 1e-4
    for track_ in result.clip.tracks[1:]:
        assert quaternion.angle_between(track_.values[:1], track_.values[-1:])[0] < 1e-12
        steps = quaternion.angle_between(track_.values[1:], track_.values[:-1])
        assert abs(steps[-1] - steps[0]) < 0.2 * steps.max()  # its speed goes on, too
    endless = Clip(
        "", (track("rotation", np.arange(1201) / 60, about("z", 40 * np.sin(np.pi * np.arange(1201) / 30))),)
    )
    late = simulate_springs(CHAIN, endless, BONES).clip.tracks[1].values[-61:]
    assert quaternion.angle_between(late, result.clip.tracks[1].values).max() < 1e-3


def test_a_loop_has_the_nearest_step_that_divides_it() -> None:
    result = simulate_springs(CHAIN, swaying(), BONES, SpringOptions(loop=True, duration=0.99))
    assert result.num_steps == 59
    assert result.step == 0.99 / 59


def test_root_motion_does_not_shake_a_loop() -> None:
    """A figure that walks away has the loop of one that stays, but for the tail that its speed blows back."""
    walk = track("translation", [0, 1], [[0, 0, 0], [4, 0, 0]])
    result = simulate_springs(CHAIN, Clip("", (walk,)), BONES, SpringOptions(loop=True))
    assert result.loop is not None
    assert result.loop.settled
    steps = quaternion.angle_between(result.clip.tracks[1].values[1:], result.clip.tracks[1].values[:-1])
    assert steps.max() < 1e-3


def test_a_loop_that_never_settles_is_blended() -> None:
    """Without drag nothing is forgotten."""
    endless = SpringParameters(stiffness=0.0, drag=0.0)
    chain = SpringChain("", (SpringJoint(1, 2, endless),))
    result = simulate_springs(CHAIN, swaying(), SpringBones((chain,)), SpringOptions(loop=True))
    assert result.loop is not None
    assert not result.loop.settled
    assert result.loop.rounds == 20
    assert result.loop.seam > 1e-4
    values = result.clip.tracks[1].values
    assert quaternion.angle_between(values[:1], values[-1:])[0] < 1e-12


def test_the_rest_pose_drives_without_a_clip() -> None:
    result = simulate_springs(CHAIN, Clip("drop", ()), BONES, SpringOptions(duration=1.0))
    assert [track.target for track in result.clip.tracks] == [(1, "rotation"), (2, "rotation")]
    with pytest.raises(RangeError, match="has no clip with a length"):
        simulate_springs(CHAIN, Clip("", ()), BONES)


def test_half_the_step_changes_an_oscillator_little() -> None:
    """The error of moderate swings (20°) is below half a degree at 60 Hz, and falls with the step."""
    joints = tuple(replace(joint, parameters=SpringParameters(frequency=2.0)) for joint in ONE.joints)
    times = np.arange(61) / 60
    gentle = Clip("", (track("rotation", times, about("z", 5 * np.sin(2 * np.pi * times))),))
    tips = [
        simulate_springs(CHAIN, gentle, SpringBones((replace(ONE, joints=joints),)), SpringOptions(step=1 / rate))
        for rate in (60, 120, 240, 480)
    ]
    changes = [
        quaternion.angle_between(a.clip.tracks[2].values, b.clip.tracks[2].values).max() for a, b in pairwise(tips)
    ]
    assert changes[0] < np.radians(0.5)
    assert changes[1] < 0.6 * changes[0]
    assert changes[2] < 0.6 * changes[1]


def test_the_same_run_gives_the_same_bytes() -> None:
    document = opened_fixture("springs")
    data = [glb_of(_baked(document)) for _ in range(2)]
    assert data[0] == data[1]


@needs_validator
def test_the_file_passes_the_validator() -> None:
    assert errors(validate(glb_of(_baked(opened_fixture("springs"))))) == []


def _baked(document: Document) -> Document:
    clip = reader.clips(document)[0]
    result = simulate_springs(reader.skeleton(document), clip, read_spring_bones(document))
    return writer.replace_clips(document, {0: result.clip})


def test_glbs_are_read_as_they_were_written() -> None:
    document = _baked(opened_fixture("springs"))
    again = reader.clips(opened(glb_of(document)))[0]
    assert len(again.tracks) == 43
