"""Springs that are refused, left out or noted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from anim.errors import AnimError, FormatError, NotFoundError, RangeError, ShapeError, UnstableError, UnsupportedError
from anim.model import Clip
from anim.simulation.spring_bones import hierarchy, plan
from anim.simulation.spring_bones.angle_limits import AngleLimit, LimitShape
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, SpringParameters
from anim.simulation.spring_bones.colliders import Collider, ColliderShape
from anim.simulation.spring_bones.simulate import SpringOptions, simulate_springs
from tests.anim.simulation.spring_bones.swaying import BONES, CHAIN, DOWN, ONE, SOFT, swaying
from tests.clips import STEP, skeleton, track


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


@pytest.mark.parametrize(
    ("scale", "noted"), [((1.0, 2.0, 1.0), True), ((2.0, 2.0, 2.0), False), ((1.0, 1.0, 3.0), False)]
)
def test_a_joint_whose_own_scale_turns_its_bone_is_noted(scale: tuple[float, float, float], noted: bool) -> None:
    """The tail is at (1, −1, 0): twice as far down it is drawn atan 2 − 45° lower."""
    slanted = skeleton(
        [-1, 0, 1, 2],
        translation=[[0, 0, 0], [0, 1, 0], [1, -1, 0], DOWN],
        scale=[[1, 1, 1], scale, [1, 1, 1], [1, 1, 1]],
    )
    words = "node 1 '1' has a non-uniform scale, 1 × 2 × 1: its bone is drawn 18° from where it swings, as in players"
    assert simulate_springs(slanted, swaying(), BONES).notes == (words,) * noted


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
    ],
)
@pytest.mark.parametrize("loop", [False, True])
def test_times_out_of_range_are_refused(options: SpringOptions, words: str, *, loop: bool) -> None:
    with pytest.raises(RangeError) as caught:
        simulate_springs(CHAIN, swaying(), BONES, replace(options, loop=loop))
    assert words in str(caught.value)


def test_too_many_steps_are_refused() -> None:
    with pytest.raises(UnsupportedError, match="more than 10000000 steps") as caught:
        simulate_springs(CHAIN, swaying(), BONES, SpringOptions(step=1e-12))
    assert "a longer `step`" in caught.value.help


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


def test_a_chain_of_too_many_joints_is_refused_before_it_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "MAX_LEVELS", 1)
    with pytest.raises(UnsupportedError, match=r"2 nodes below each other move with springs \(limit 1\)"):
        simulate_springs(CHAIN, swaying(), BONES)


def test_a_tail_many_nodes_below_its_joint_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hierarchy, "MAX_TAIL_NODES", 1)
    far = SpringBones((replace(ONE, joints=(SpringJoint(1, 3, SOFT),)),))
    with pytest.raises(
        UnsupportedError, match=r"the tail of node 1 '1' is 2 nodes below it, node 3 '3' \(limit 1\)"
    ) as caught:
        simulate_springs(CHAIN, swaying(), far)
    assert caught.value.help == "make the nodes between them joints of the spring"


HUGE = 10**400


@pytest.mark.parametrize(
    "make",
    [
        lambda: AngleLimit(LimitShape.CONE, 1.0, rotation=(HUGE, 0, 0, 1)),
        lambda: AngleLimit(LimitShape.CONE, HUGE),
        lambda: Collider(0, ColliderShape.SPHERE, offset=(0, -HUGE, 0)),
        lambda: Collider(0, ColliderShape.SPHERE, radius=HUGE),
        lambda: SpringParameters(stiffness=HUGE),
        lambda: SpringParameters(gravity=(0, HUGE, 0)),
    ],
    ids=["rotation", "angle", "offset", "radius", "stiffness", "gravity"],
)
def test_integers_beyond_all_floats_are_out_of_range(make: Callable[[], object]) -> None:
    with pytest.raises(RangeError, match=r"(is|holds) -?inf \(expected"):
        make()


def test_a_rotation_has_four_numbers() -> None:
    with pytest.raises(ShapeError, match=r"rotation has 3 numbers \(expected 4\)"):
        AngleLimit(LimitShape.CONE, 1.0, rotation=(0, 0, 1))  # type: ignore[arg-type]
    with pytest.raises(RangeError, match="expected a unit quaternion"):
        AngleLimit(LimitShape.CONE, 1.0, rotation=(0, 0, 0, 0))
