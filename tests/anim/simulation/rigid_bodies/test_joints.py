"""Joints of KHR_physics_rigid_bodies on documents by its text: limits of 1, 2 and 3 axes, motors, springs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.maths import quaternion
from anim.simulation.rigid_bodies.simulate import RigidRun
from tests.anim.simulation.rigid_bodies.cases import Array, G, collider, document, needs_rapier, node, path, simulate

pytestmark = needs_rapier
BOX = [{"type": "box", "box": {"size": [1.0, 0.2, 0.2]}}]
LOCKED: dict[str, Any] = {"linearAxes": [0, 1, 2], "max": 0}
NO_TURN: dict[str, Any] = {"angularAxes": [0, 1, 2], "max": 0}
AWAY = [0.5, 0.0, 0.0]


def swing(
    limits: list[dict[str, Any]],
    drives: list[dict[str, Any]] | None = None,
    *,
    motion: dict[str, Any] | None = None,
    seconds: float = 2.0,
    gravity: tuple[float, float, float] = (0, -G, 0),
) -> RigidRun:
    """A box of 1 m and 2 kg along X with its end at the origin, on a joint with the world there.

    Node 1 is the joint's frame in the world, node 2 the box, and node 3 the frame at its end.
    """
    made = document(
        [
            node(),
            node((0, 0, 0), joint={"connectedNode": 3, "joint": 0}),
            node(AWAY, children=[3], motion={"mass": 2.0, **(motion or {})}, collider=collider(0)),
            node([-0.5, 0, 0]),
        ],
        BOX,
        physicsJoints=[{"limits": limits, "drives": drives or []}],
    )
    return simulate(made, duration=seconds, gravity=gravity)


def end(run: RigidRun) -> Array:
    """Position (K, 3) of the box's end: the joint's frame."""
    return path(run, 2) - quaternion.rotate(path(run, 2, "rotation"), np.array(AWAY))


def angles(run: RigidRun) -> Array:
    """Rotation vector (K, 3) of the box."""
    return quaternion.rotation_vector(path(run, 2, "rotation"))


def test_a_joint_without_freedom_holds_the_body() -> None:
    run = swing([LOCKED, NO_TURN])
    np.testing.assert_allclose(path(run, 2), np.broadcast_to(AWAY, path(run, 2).shape), atol=3e-3)


def test_a_hinge_stops_at_its_limits() -> None:
    run = swing([LOCKED, {"angularAxes": [0, 1], "max": 0}, {"angularAxes": [2], "min": -0.6, "max": 0.2}], seconds=4.0)
    np.testing.assert_allclose(end(run), 0, atol=4e-3)
    assert angles(run)[:, 2].min() > -0.65
    assert angles(run)[-1, 2] == pytest.approx(-0.6, abs=0.02)
    np.testing.assert_allclose(angles(run)[:, :2], 0, atol=0.01)


def test_a_hinge_without_limits_swings_through() -> None:
    run = swing([LOCKED, {"angularAxes": [0, 1], "max": 0}], seconds=1.2)
    assert angles(run)[:, 2].min() < -2.8


def test_a_slider_stops_at_its_limit() -> None:
    run = swing([{"linearAxes": [0, 2], "max": 0}, {"linearAxes": [1], "min": -0.4, "max": 0.1}, NO_TURN])
    moved = path(run, 2) - AWAY
    assert moved[-1, 1] == pytest.approx(-0.4, abs=5e-3)
    np.testing.assert_allclose(moved[:, [0, 2]], 0, atol=3e-3)


def test_a_rope_of_three_linear_axes_stops_at_its_length() -> None:
    run = swing([{"linearAxes": [0, 1, 2], "max": 0.5}, NO_TURN])
    assert np.linalg.norm(end(run), axis=1).max() < 0.52
    assert end(run)[-1, 1] == pytest.approx(-0.5, abs=0.02)


def test_a_cone_of_two_angular_axes_stops_the_swing() -> None:
    """The cone is around X: the box hangs 0.5 rad below it."""
    run = swing([LOCKED, {"angularAxes": [1, 2], "max": 0.5}], seconds=3.0)
    direction = quaternion.rotate(path(run, 2, "rotation"), np.array([1.0, 0, 0]))
    assert np.arccos(np.clip(direction[-1, 0], -1, 1)) == pytest.approx(0.5, abs=0.03)


def test_an_angle_about_three_axes_is_limited_as_swing_and_twist() -> None:
    run = swing([LOCKED, {"angularAxes": [0, 1, 2], "max": 0.5}], motion={"angularVelocity": [4.0, 0, 0]})
    rotations = path(run, 2, "rotation")
    along = quaternion.rotate(rotations, np.array([1.0, 0, 0]))
    twists = 2 * np.arctan2(rotations[:, 0], rotations[:, 3])
    assert 0.45 < np.arccos(along[:, 0]).max() < 0.55
    assert 0.4 < np.abs(twists).max() < 0.55
    assert run.notes == ["a limit of the angle about 3 axes is one of the swing, and one of the twist"]


def test_cones_of_several_limits_are_not_joined() -> None:
    """Rapier panics for a joint whose coupled angular axes are three."""
    run = swing([LOCKED, {"angularAxes": [1, 2], "max": 0.5}, {"angularAxes": [0, 1], "max": 0.2}])
    assert 0.45 < np.linalg.norm(angles(run), axis=1).max() < 0.55
    assert run.notes == [
        "of several limits of angles about 2 or 3 axes, the second and later ones hold for each axis by itself"
    ]


def test_a_drive_holds_its_velocity() -> None:
    turning = {"type": "angular", "mode": "force", "axis": 2, "velocityTarget": 3.0, "damping": 500.0}
    run = swing([LOCKED, {"angularAxes": [0, 1], "max": 0}], [turning], gravity=(0, 0, 0), seconds=1.0)
    assert angles(run)[-1, 2] - angles(run)[-31, 2] == pytest.approx(3.0 * 0.5, rel=0.02)


@pytest.mark.parametrize("mode", ["force", "acceleration"])
def test_a_drive_reaches_its_position(mode: str) -> None:
    pull = {"type": "linear", "mode": mode, "axis": 1, "positionTarget": 0.3, "stiffness": 400.0, "damping": 40.0}
    run = swing([{"linearAxes": [0, 2], "max": 0}, NO_TURN], [pull], gravity=(0, 0, 0))
    assert path(run, 2)[-1, 1] == pytest.approx(0.3, abs=2e-3)


def test_a_spring_sags_by_weight_over_stiffness() -> None:
    pull = {"type": "linear", "mode": "force", "axis": 1, "positionTarget": 0.0, "stiffness": 100.0, "damping": 20.0}
    run = swing([{"linearAxes": [0, 2], "max": 0}, NO_TURN], [pull], seconds=6.0)
    assert path(run, 2)[-1, 1] == pytest.approx(-2 * G / 100, rel=0.02)


def test_a_soft_limit_is_a_spring() -> None:
    soft = {"linearAxes": [1], "min": 0, "max": 0, "stiffness": 100.0, "damping": 20.0}
    run = swing([{"linearAxes": [0, 2], "max": 0}, soft, NO_TURN], seconds=6.0)
    assert path(run, 2)[-1, 1] == pytest.approx(-2 * G / 100, rel=0.02)


def test_a_soft_range_is_hard_and_says_so() -> None:
    soft = {"linearAxes": [1], "min": -0.2, "max": 0.2, "stiffness": 100.0}
    run = swing([{"linearAxes": [0, 2], "max": 0}, soft, NO_TURN])
    assert run.notes == ["soft limits of a range are hard"]
    assert path(run, 2)[-1, 1] == pytest.approx(-0.2, abs=5e-3)


def test_a_weak_motor_does_not_lift_the_body() -> None:
    pull = {"type": "linear", "mode": "force", "axis": 1, "positionTarget": 1.0, "stiffness": 4000.0, "damping": 40.0}
    limits = [{"linearAxes": [0, 2], "max": 0}, {"linearAxes": [1], "min": -0.3, "max": 1}, NO_TURN]
    weak = swing(limits, [{**pull, "maxForce": 15.0}])
    strong = swing(limits, [{**pull, "maxForce": 200.0}])
    assert path(weak, 2)[-1, 1] == pytest.approx(-0.3, abs=0.01)
    assert path(strong, 2)[-1, 1] > 0.9


@pytest.mark.parametrize("enable", [False, True])
def test_jointed_bodies_collide_only_if_enabled(enable: bool) -> None:
    """The upper box falls onto the lower, static one along the joint's axis."""
    made = document(
        [
            node((0, 0, 0), collider=collider(0), joint={"connectedNode": 1, "joint": 0, "enableCollision": enable}),
            node((0, 1, 0), motion={"mass": 1.0}, collider=collider(0)),
        ],
        BOX,
        physicsJoints=[{"limits": [{"linearAxes": [0, 2], "max": 0}, NO_TURN]}],
    )
    height = path(simulate(made, duration=1.0), 1)[-1, 1]
    assert (height == pytest.approx(0.2, abs=0.01)) if enable else height < -1
