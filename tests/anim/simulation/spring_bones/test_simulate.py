"""Clips with simulated springs: tracks, timing, loops, determinism, refusals."""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from anim.errors import AnimError, FormatError, NotFoundError, RangeError, UnstableError
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.maths import quaternion
from anim.model import Clip, Skeleton
from anim.sampling.track import sample
from anim.simulation.spring_bones.chain_globs import find_chains
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, SpringParameters
from anim.simulation.spring_bones.colliders import Collider, ColliderShape
from anim.simulation.spring_bones.read import read_spring_bones
from anim.simulation.spring_bones.simulate import SpringOptions, simulate_springs
from tests.clips import STEP, about, skeleton, track
from tests.files import glb_of, opened, opened_fixture
from tests.khronos import errors, needs_validator, validate

DOWN = [0, -0.2, 0]
CHAIN = skeleton([-1, 0, 1, 2], translation=[[0, 0, 0], [0, 1, 0], DOWN, DOWN])  # a root, two joints, and a tip
SOFT = SpringParameters(stiffness=0.5, drag=0.2, gravity=(0, -0.3, 0))
ONE = SpringChain("tail", (SpringJoint(1, 2, SOFT), SpringJoint(2, 3, SOFT)))
BONES = SpringBones((ONE,))


def swaying(*extra: object) -> Clip:
    """One second of a root that turns there and back."""
    times = np.arange(61) / 60
    turn = track("rotation", times, about("z", 40 * np.sin(2 * np.pi * times)))
    return Clip("sway", (turn, *extra))  # type: ignore[arg-type]


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
    with pytest.raises(RangeError, match="`duration` is 0 s"):
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


def test_numbers_that_get_too_large_are_reported() -> None:
    with np.errstate(over="ignore"):
        ways = np.outer([0, 1.5e308, -1.5e308, 0], [1, 0, 0])
        far = Clip("", (track("translation", [0, 0.5, 0.52, 1], ways, STEP),))
        with pytest.raises(UnstableError, match=r"the springs diverge at 0\.5") as caught:
            simulate_springs(CHAIN, far, BONES)
    assert "`frequency`" in caught.value.help


def test_a_joint_without_length_is_left_out_with_a_note() -> None:
    flat = skeleton([-1, 0, 1, 2], translation=[[0, 0, 0], [0, 1, 0], [0, 0, 0], DOWN])
    result = simulate_springs(flat, swaying(), BONES)
    assert result.joints == (2,)
    assert result.notes == ("node 1 '1' does not swing: its tail has the same position",)


def test_a_scale_of_0_leaves_the_rest_rotation() -> None:
    vanishing = Clip("", (track("scale", [0, 0.5, 1], [[1, 1, 1], [0, 0, 0], [1, 1, 1]]), *swaying().tracks))
    values = simulate_springs(CHAIN, vanishing, BONES).clip.tracks[2].values
    assert np.isfinite(values).all()


def test_a_collider_on_a_scaled_node_is_noted() -> None:
    scaled = skeleton(
        [-1, 0, 1, 2], translation=[[0, 0, 0], [0, 1, 0], DOWN, DOWN], scale=[[2, 2, 2], *[[1, 1, 1]] * 3]
    )
    ball = SpringBones((replace(ONE, colliders=(0,)),), (Collider(0, ColliderShape.SPHERE, radius=0.1),))
    (note,) = simulate_springs(scaled, swaying(), ball).notes
    assert note == "collider 0 on node 0 '0' has a scale of 2, its radius of 0.1 m is not scaled, as in players"
    assert simulate_springs(CHAIN, swaying(), ball).notes == ()


SELF = SpringBones((replace(ONE, colliders=(0,)),), (Collider(2, ColliderShape.SPHERE, radius=0.1),))
TWICE = SpringBones((ONE, replace(ONE, name="again")))


@pytest.mark.parametrize(
    ("bones", "kind", "words"),
    [
        (
            SELF,
            FormatError,
            "node 1 '1' collides with collider 0, which it moves itself: the collider is on node 2 '2'",
        ),
        (TWICE, FormatError, "node 1 '1' is a joint of spring 0 'tail' and of spring 1 'again'"),
        (SpringBones((replace(ONE, center=2),)), FormatError, "center is node 2 '2'"),
        (SpringBones((replace(ONE, colliders=(3,)),)), FormatError, "there is no collider 3"),
        (SpringBones((SpringChain("", (SpringJoint(2, 1, SOFT),)),)), FormatError, "node 1 '1' follows node 2 '2'"),
        (SpringBones((SpringChain("", (SpringJoint(9, 3, SOFT),)),)), NotFoundError, "there is no node 9 for a joint"),
        (SpringBones((SpringChain("", (SpringJoint(1, 2, SOFT), SpringJoint(1, 3, SOFT))),)), FormatError, "twice"),
    ],
)
def test_chains_that_fit_no_skeleton_are_refused(bones: SpringBones, kind: type[AnimError], words: str) -> None:
    with pytest.raises(kind) as caught:
        simulate_springs(CHAIN, swaying(), bones)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_chains_that_collide_with_each_other_are_refused() -> None:
    two = skeleton([-1, 0, 1, 0, 3], translation=[[0, 0, 0], [0, 1, 0], DOWN, [1, 1, 0], DOWN])
    chains = (
        SpringChain("a", (SpringJoint(1, 2, SOFT),), (1,)),
        SpringChain("b", (SpringJoint(3, 4, SOFT),), (0,)),
    )
    balls = (Collider(2, ColliderShape.SPHERE, radius=0.1), Collider(4, ColliderShape.SPHERE, radius=0.1))
    with pytest.raises(FormatError, match="spring 0 'a': node 1 '1' depends on itself, through colliders"):
        simulate_springs(two, Clip("", ()), SpringBones(chains, balls), SpringOptions(duration=1))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (SpringOptions(step=0), "`step` is 0 s"),
        (SpringOptions(step=float("nan")), "`step` is nan s"),
        (SpringOptions(duration=-1), "duration` is -1 s"),
        (SpringOptions(duration=float("inf")), "`duration` is inf s"),
        (SpringOptions(warm_up=-1), "`warm_up` is -1 s"),
        (SpringOptions(fps=0), "`fps` is 0"),
        (SpringOptions(step=1e-12), "more than 10000000 steps"),
    ],
)
@pytest.mark.parametrize("loop", [False, True])
def test_times_out_of_range_are_refused(options: SpringOptions, words: str, *, loop: bool) -> None:
    with pytest.raises(RangeError) as caught:
        simulate_springs(CHAIN, swaying(), BONES, replace(options, loop=loop))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("stiffness", -1.0),
        ("stiffness", float("nan")),
        ("drag", 1.5),
        ("drag", float("nan")),
        ("hit_radius", -0.1),
        ("frequency", 0.0),
        ("frequency", float("inf")),
        ("damping_ratio", -0.5),
        ("gravity", (0, float("nan"), 0)),
    ],
)
def test_parameters_out_of_range_are_refused(name: str, value: object) -> None:
    with pytest.raises(RangeError, match=name.replace("_", " ")):
        SpringParameters(**{name: value})  # type: ignore[arg-type]


def test_a_negative_radius_is_refused() -> None:
    with pytest.raises(RangeError, match=r"radius is -0.1 \(expected 0 or more\)"):
        Collider(0, ColliderShape.SPHERE, radius=-0.1)
    with pytest.raises(RangeError, match="normal is 0, 0, 0"):
        Collider(0, ColliderShape.PLANE, normal=(0, 0, 0))


# Chains by globs.


def rig() -> Skeleton:
    """Body, a tail of three with an attachment, two ears; the names of a usual rig."""
    names = ("Body", "Tail1", "Tail2", "Tail3", "Bow", "Ear.L", "Ear.R")
    places = [[0, 0, 0], [0, 0, -1], [0, 0, -1], [0, 0, -1], [0, 0.1, 0], [1, 1, 0], [-1, 1, 0]]
    plain = skeleton([-1, 0, 1, 2, 2, 0, 0], translation=places)
    return Skeleton(names, plain.parents, plain.translation, plain.rotation, plain.scale)


def test_a_chain_begins_at_the_topmost_match() -> None:
    chains = find_chains(rig(), ["Tail*"], SOFT, skin_joints={0, 1, 2, 3, 5, 6})
    assert [(chain.name, [j.node for j in chain.joints]) for chain in chains] == [("Tail1", [1, 2, 3])]
    assert [joint.tail for joint in chains[0].joints] == [2, 3, None]
    assert chains[0].joints[2].tail_offset == (0, 0, -1)


def test_without_skins_every_node_below_is_a_joint() -> None:
    (chain,) = find_chains(rig(), ["Tail1"], SOFT)
    assert [joint.node for joint in chain.joints] == [1, 2, 3, 4]


def test_every_match_is_a_chain_of_its_own() -> None:
    chains = find_chains(rig(), ["Ear.*"], SOFT)
    assert [[joint.node for joint in chain.joints] for chain in chains] == [[5], [6]]


def test_a_glob_without_match_is_refused_with_similar_names() -> None:
    with pytest.raises(NotFoundError, match=r"no node matches 'Tial\*'") as caught:
        find_chains(rig(), ["Tial*"], SOFT)
    assert "Tail" in caught.value.help
    with pytest.raises(NotFoundError, match="no chain begins at node 0 '0': it has no length"):
        find_chains(skeleton([-1]), ["0"], SOFT)


@pytest.mark.slow
def test_fifty_chains_of_ten_joints_take_less_than_a_second() -> None:
    """600 steps; 0.4 s of CPU where the note's prototype takes 0.7 s."""
    count = 50 * 11
    parents = [-1] + [0 if k % 11 == 0 else k for k in range(count)]
    places = [[0, 0, 0]] + [[k, 0, 0] if k % 11 == 0 else [0, -0.1, 0] for k in range(count)]
    chains = find_chains(skeleton(parents, translation=places), [str(1 + 11 * k) for k in range(50)], SOFT)
    began = time.process_time()
    result = simulate_springs(
        skeleton(parents, translation=places), swaying(), SpringBones(chains), SpringOptions(duration=10)
    )
    assert time.process_time() - began < 2
    assert len(result.joints) == count


def test_glbs_are_read_as_they_were_written() -> None:
    document = _baked(opened_fixture("springs"))
    again = reader.clips(opened(glb_of(document)))[0]
    assert len(again.tracks) == 43
