"""Rapier against closed forms: fall, bounce, incline, spin, pendulum, stack, mass."""

from __future__ import annotations

import numpy as np
import pytest

from anim.maths import quaternion
from anim.simulation.rigid_bodies.description import JointLimit, Material, Motion, Shape
from anim.simulation.rigid_bodies.rapier.world import RapierWorld
from anim.simulation.rigid_bodies.rigid_scene import WORLD, RigidJoint, RigidScene
from tests.anim.simulation.rigid_bodies.cases import G, body, frame, ground, needs_rapier, run

pytestmark = needs_rapier
BALL = Shape("sphere", (0.1,))
CUBE = Shape("box", (0.5, 0.5, 0.5))


@pytest.mark.parametrize("step", [1 / 60, 1 / 240])
def test_a_free_flight_is_its_parabola(step: float) -> None:
    """Rapier alone is ½·g·t·h/4 off: 5.1 mm after 1 s at 1/240."""
    motion = run(body(BALL, (0, 10, 0), velocity=(1, 5, 0)), step=step)
    t = motion.times[:, None]
    expected = np.array([0, 10, 0]) + np.array([1, 5, 0]) * t + 0.5 * np.array([0, -G, 0]) * t**2
    np.testing.assert_allclose(motion.positions[:, 0], expected, atol=2e-4)


@pytest.mark.parametrize(("step", "least"), [(1 / 60, 0.96), (1 / 240, 0.985)])
@pytest.mark.parametrize("e", [0.5, 0.8, 1.0])
def test_a_bounce_keeps_the_square_of_the_restitution(e: float, step: float, least: float) -> None:
    material = Material(0, 0, e)
    motion = run(ground(material), body(BALL, (0, 1.1, 0), material=material), seconds=1.3, step=step)
    height = motion.positions[:, 0, 1] - 0.1
    low = int(np.argmin(height[: round(0.7 / step)]))
    assert least * e * e <= height[low:].max() <= 1.001 * e * e
    assert height.min() > -0.04


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("height", [1.1, 1.234, 5.37])  # from the last one Rapier finds the ball inside the floor
def test_the_time_of_an_impact_is_that_of_the_parabola(e: float, height: float) -> None:
    material = Material(0, 0, e)
    motion = run(ground(material), body(BALL, (0, height, 0), material=material), seconds=1.2)
    first = motion.impacts[0][0]
    assert first.time == pytest.approx(np.sqrt(2 * (height - 0.1) / G), abs=5e-6)
    np.testing.assert_allclose(first.position, [0, 0.1, 0], atol=1e-6)


def test_two_balls_meet_when_their_distance_says() -> None:
    balls = [body(BALL, (-1, 0, 0), velocity=(3, 0, 0)), body(BALL, (1, 0, 0), velocity=(-1, 0, 0))]
    motion = run(*balls, seconds=1.0, gravity=(0, 0, 0))
    for own, x in zip(motion.impacts, (0.35, 0.55), strict=True):
        assert [each.time for each in own] == [pytest.approx(0.45, abs=5e-6)]
        np.testing.assert_allclose(own[0].position, [x, 0, 0], atol=1e-4)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("part", [0.05, 0.2, 0.5, 0.8])
def test_an_impact_anywhere_in_a_step_is_found(part: float, e: float) -> None:
    """Early in a step Rapier bounces in a substep before its last, of which it states the impulse: 0."""
    material, hit = Material(0, 0, e), (100 + part) / 240
    balls = [body(BALL, (-0.2 - 3 * hit, 0, 0), velocity=(3, 0, 0), material=material), body(BALL, material=material)]
    motion = run(*balls, seconds=1.0, gravity=(0, 0, 0))
    assert [[each.time for each in own] for own in motion.impacts] == [[pytest.approx(hit, abs=5e-6)]] * 2
    after = (motion.positions[-1] - motion.positions[-25]) * 10  # momentum, and the speed of parting
    np.testing.assert_allclose(after[:, 0], [1.5 * (1 - e), 1.5 * (1 + e)], atol=2e-3)


def test_a_spinning_box_hits_with_its_lowest_corner() -> None:
    spin, corners = np.array([3.0, 4.0, 5.0]), np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    motion = run(ground(), body(Shape("box", (0.2, 0.2, 0.2)), (0, 1.5, 0), spin=spin), seconds=0.8)
    first = motion.impacts[0][0]

    def lowest(t: float) -> float:  # a cube's angular velocity is constant
        turned = quaternion.rotate(quaternion.from_rotation_vector(spin * t), 0.1 * corners)
        return float(turned[:, 1].min()) + 1.5 - G / 2 * t * t

    assert lowest(first.time - 1e-4) > 0 > lowest(first.time + 1e-4)
    np.testing.assert_allclose(first.rotation, quaternion.from_rotation_vector(spin * first.time), atol=1e-3)


@pytest.mark.parametrize(("friction", "degrees"), [(0.3, 30), (0.6, 25)])
def test_a_box_slides_down_an_incline_or_sticks(friction: float, degrees: float) -> None:
    angle = np.radians(degrees)
    material = Material(friction, friction)
    box = body(CUBE, (0, 0.25, 0), material=material)
    motion = run(ground(material), box, seconds=2.0, gravity=(G * np.sin(angle), -G * np.cos(angle), 0.0))
    expected = 0.5 * max(0.0, G * (np.sin(angle) - friction * np.cos(angle))) * 4
    assert motion.positions[-1, 0, 0] == pytest.approx(expected, rel=0.005, abs=1e-3)


@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_static_friction_holds_a_box_and_dynamic_friction_brakes_it(speed: float) -> None:
    """tan 30° = 0.58 lies between both: at rest it sticks, once pushed it slides faster and faster."""
    angle, material = np.radians(30), Material(0.9, 0.3)
    box = body(CUBE, (0, 0.25, 0), material=material, velocity=(speed, 0, 0))
    motion = run(ground(material), box, seconds=2.0, gravity=(G * np.sin(angle), -G * np.cos(angle), 0.0))
    slid = 2 * speed + 2 * G * (np.sin(angle) - 0.3 * np.cos(angle))
    assert motion.positions[-1, 0, 0] == pytest.approx(slid if speed else 0.0, rel=1e-3, abs=1e-4)


@pytest.mark.parametrize("speed", [0.7, 0.8, 0.9, 1.2, 1.3])
def test_a_box_pushed_up_an_incline_stops_and_sticks(speed: float) -> None:
    """It is slow for some milliseconds only before it would slide back: whenever contacts are read."""
    angle, material = np.radians(30), Material(0.9, 0.3)
    box = body(CUBE, (0, 0.25, 0), material=material, velocity=(-speed, 0, 0))
    motion = run(ground(material), box, seconds=1.0, gravity=(G * np.sin(angle), -G * np.cos(angle), 0.0))
    expected = -speed * speed / (2 * G * (np.sin(angle) + 0.3 * np.cos(angle)))
    assert motion.positions[-1, 0, 0] == pytest.approx(expected, abs=2e-3)


def test_a_box_that_slides_stops_and_sticks() -> None:
    material = Material(0.9, 0.3)
    motion = run(ground(material), body(CUBE, (0, 0.25, 0), material=material, velocity=(2, 0, 0)), seconds=2.0)
    assert motion.positions[-1, 0, 0] == pytest.approx(4 / (2 * 0.3 * G), rel=0.01)


def test_a_free_body_keeps_its_angular_momentum() -> None:
    inertia = np.array([1.0, 2.0, 3.0])
    spinning = body(BALL, spin=(0.01, 5, 0.01), motion=Motion(mass=1.0, inertia_diagonal=(1.0, 2.0, 3.0)))
    motion = run(spinning, seconds=5.0, gravity=(0, 0, 0))
    q = motion.rotations[:, 0]
    turn = quaternion.rotation_vector(quaternion.multiply(q[1:], quaternion.conjugate(q[:-1]))) * 240
    world = quaternion.rotate(q[:-1], inertia * quaternion.rotate(quaternion.conjugate(q[:-1]), turn))
    np.testing.assert_allclose(np.linalg.norm(world, axis=1), 10.0, rtol=0.02)
    np.testing.assert_allclose(motion.positions[-1, 0], 0, atol=1e-5)


def test_a_pendulum_has_the_period_of_the_elliptic_integral() -> None:
    start = np.radians(60)
    arm = np.array([np.sin(start), -np.cos(start), 0.0])
    bob = body(Shape("sphere", (0.01,)), arm, motion=Motion(mass=1.0))
    locked = (JointLimit(False, (0, 1, 2), 0.0, 0.0),)
    joint = RigidJoint((WORLD, 0), (frame(), frame(-arm)), locked, (), False)
    motion = run(bob, seconds=10.0, joints=[joint])
    x = motion.positions[:, 0, 0]
    down = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))
    period = np.diff((down + x[down] / (x[down] - x[down + 1])) / 240).mean()
    a, b = 1.0, np.cos(start / 2)
    for _ in range(30):
        a, b = (a + b) / 2, np.sqrt(a * b)
    assert period == pytest.approx(2 * np.pi / np.sqrt(G) / a, rel=0.003)
    np.testing.assert_allclose(np.linalg.norm(motion.positions[:, 0], axis=1), 1.0, atol=1e-3)
    assert np.degrees(np.arcsin(np.abs(x[-500:]).max())) > 58


def test_a_stack_of_boxes_stays_and_sleeps() -> None:
    boxes = [body(CUBE, (0, 0.25 + 0.5 * i, 0)) for i in range(13)]
    motion = run(ground(), *boxes, seconds=4.0)
    np.testing.assert_allclose(motion.positions[-1, :, 1], 0.25 + 0.5 * np.arange(13), atol=0.02)
    np.testing.assert_allclose(motion.positions[-1, :, [0, 2]], 0, atol=0.01)
    np.testing.assert_array_equal(motion.positions[-1], motion.positions[-60])
    assert motion.energies[-1, 0] == 0


def test_mass_and_energy_are_those_of_the_shapes() -> None:
    world = RapierWorld(RigidScene((body(CUBE, (0, 2, 0), velocity=(3, 0, 0)),), (), (0.0, -G, 0.0)), 1e-4)
    world.step()
    assert world.mass() == pytest.approx(125, rel=1e-5)
    kinetic, _ = world.energy()
    assert kinetic == pytest.approx(0.5 * 125 * 9, rel=1e-3)


def test_a_hull_weighs_as_its_points_enclose() -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    world = RapierWorld(RigidScene((body(Shape("hull", points=corners)),), (), (0.0, 0.0, 0.0)), 0.01)
    world.step()
    assert world.mass() == pytest.approx(1000, rel=1e-4)


def test_the_same_scene_gives_the_same_numbers() -> None:
    boxes = [body(CUBE, (0.1 * i, 0.3 + 0.55 * i, 0)) for i in range(8)]
    first, second = (run(ground(), *boxes, seconds=2.0) for _ in range(2))
    np.testing.assert_array_equal(first.positions, second.positions)
    np.testing.assert_array_equal(first.rotations, second.rotations)
