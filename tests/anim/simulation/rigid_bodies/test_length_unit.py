"""Small bodies in enlarged worlds: the same motion, and hulls of centimetres that stay on each other."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from anim.maths import quaternion
from anim.simulation.rigid_bodies.description import JointDrive, JointLimit, Material, Motion, Shape
from anim.simulation.rigid_bodies.extents import body_extent
from anim.simulation.rigid_bodies.notes import find_notes
from anim.simulation.rigid_bodies.rapier import world
from anim.simulation.rigid_bodies.rapier.length_unit import ENLARGED_RADIUS_UNITS, choose_unit, plane_reach, scale_scene
from anim.simulation.rigid_bodies.rigid_scene import BodyKind, RigidBody, RigidJoint, RigidScene
from anim.simulation.rigid_bodies.shape_extents import ShapeExtents
from tests.anim.simulation.rigid_bodies.cases import NO_CLIP, ORIGIN, G, body, ground, needs_rapier, path, run
from tests.anim.simulation.rigid_bodies.test_joints import LOCKED, NO_TURN, swing
from tests.clips import skeleton

pytestmark = needs_rapier
FREE_X: dict[str, Any] = {"linearAxes": [1, 2], "max": 0}
HINGE: dict[str, Any] = {"angularAxes": [0, 1], "max": 0}
DRIVE: dict[str, Any] = {"type": "angular", "axis": 2, "velocityTarget": 3.0, "damping": 5.0}
JOINTS: dict[str, Any] = {
    "hinge": {"limits": [LOCKED, HINGE]},
    "range of angles": {"limits": [LOCKED, HINGE, {"angularAxes": [2], "min": -0.5, "max": 0.3}]},
    "range of distances": {"limits": [FREE_X, NO_TURN, {"linearAxes": [0], "min": -0.2, "max": 0.3}]},
    "soft angle": {"limits": [LOCKED, HINGE, {"angularAxes": [2], "max": 0, "min": 0, "stiffness": 40, "damping": 2}]},
    "soft distance": {"limits": [FREE_X, NO_TURN, {"linearAxes": [0], "min": 0, "max": 0, "stiffness": 80}]},
    "torque": {"limits": [LOCKED, HINGE], "drives": [{**DRIVE, "mode": "force", "maxForce": 30.0}]},
    "angular acceleration": {"limits": [LOCKED, HINGE], "drives": [{**DRIVE, "mode": "acceleration"}]},
    "force": {
        "limits": [FREE_X, NO_TURN],
        "drives": [
            {"type": "linear", "axis": 0, "mode": "force", "positionTarget": 0.4, "stiffness": 60, "damping": 9}
        ],
    },
    "weak force": {
        "limits": [FREE_X, NO_TURN],
        "drives": [{"type": "linear", "axis": 0, "mode": "force", "velocityTarget": 2, "damping": 50, "maxForce": 1.5}],
    },
}


@pytest.mark.parametrize("name", JOINTS)
def test_joints_move_alike_in_an_enlarged_world(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for units in (1.0, 8.0):
        monkeypatch.setattr(world, "choose_unit", lambda scene, units=units: units)
        made = swing(**JOINTS[name], seconds=0.5, motion={"inertiaDiagonal": [0.1, 0.4, 0.4]}, gravity=(0.7, -G, 0))
        found.append(np.concatenate([path(made, 2), path(made, 2, "rotation")], axis=1))
    assert np.ptp(found[0], axis=0).max() > 1e-2
    np.testing.assert_allclose(found[0], found[1], atol=2e-3)


def test_free_bodies_move_and_weigh_alike_in_an_enlarged_world(monkeypatch: pytest.MonkeyPatch) -> None:
    given = Motion(mass=3.0, center_of_mass=(0.1, 0.05, 0.0), inertia_diagonal=(0.2, 0.3, 0.4))
    capsule = Shape("capsule", (0.3, 0.1, 0.1), center=(0.0, 0.2, 0.0))
    bodies = (
        ground(Material(0.8, 0.4, 0.5)),
        body(Shape("box", (0.5, 0.3, 0.2)), (0, 1, 0), velocity=(1, 0, 0), spin=(1, 2, 3), motion=given),
        body(capsule, (3, 1, 0), velocity=(0, 0, 2), material=Material(0.8, 0.4, 0.5)),
    )
    found, energies = [], []
    for units in (1.0, 4.0):
        monkeypatch.setattr(world, "choose_unit", lambda scene, units=units: units)
        motion = run(*bodies, seconds=0.5)
        found.append(motion.positions)
        energies.append(motion.energies)
    np.testing.assert_allclose(found[0][:90], found[1][:90], atol=1e-4)
    np.testing.assert_allclose(found[0], found[1], atol=3e-2)  # contacts begin at another distance
    assert found[0][-1, 0, 1] < 0.5
    np.testing.assert_allclose(energies[0], energies[1], rtol=3e-2, atol=0.3)


def test_bricks_of_centimetres_stay_on_each_other() -> None:
    """Hulls that touch, which fell into each other; Rapier stated depths of 120 m."""
    size = np.array([0.04, 0.02, 0.02])
    brick = Shape("hull", points=size * (np.array(list(product((0, 1), repeat=3))) - 0.5))
    rows = [(size[0] * (x + 0.5 * y), size[1] * (y + 0.5), 0.0) for y in range(6) for x in range(6 - y)]
    motion = run(ground(), *(body(brick, at) for at in rows), seconds=1.0)
    assert not motion.overlaps
    assert motion.penetration < 1.5e-3
    np.testing.assert_allclose(motion.positions[-1], rows, atol=3e-3)


def test_bricks_fall_alike_wherever_their_origin_is() -> None:
    """Applied transforms: all nodes at the origin, and points beside it."""
    corners = np.array([0.04, 0.02, 0.02]) * (np.array(list(product((0, 1), repeat=3))) - 0.5)
    places = np.array([[0.0, 0.012, 0.0], [0.01, 0.035, 0.0], [-0.01, 0.06, 0.005]])
    found = []
    for shifts in (np.zeros((3, 3)), places - (1.0, 0.0, 0.0)):
        bricks = (
            body(Shape("hull", points=corners + shift), at - shift) for at, shift in zip(places, shifts, strict=True)
        )
        motion = run(ground(), *bricks, seconds=0.8)
        found.append(motion.positions + quaternion.rotate(motion.rotations, np.broadcast_to(shifts, (193, 3, 3))))
    np.testing.assert_allclose(found[0], found[1], atol=4e-3)
    assert np.ptp(found[0], axis=0).max() > 1e-3


def test_the_radius_of_a_body_is_that_of_its_shapes() -> None:
    corners = 0.02 * np.array(list(product((-1, 1), repeat=3)))
    sphere = Shape("sphere", (0.03,), center=(3.0, 0.0, 0.0))
    for shape, radius in ((Shape("hull", points=corners + np.array([1.0, 0, 0])), 0.02 * 3**0.5), (sphere, 0.03)):
        center, found = body_extent(body(shape, (5, 5, 5)), ShapeExtents())
        np.testing.assert_allclose(found, radius)
        assert center[0] in (1.0, 3.0)
    assert body_extent(body(None), ShapeExtents()).radius == body_extent(ground(), ShapeExtents()).radius == 0.0


def bolt(position: ArrayLike = (0, 0, 0), velocity: ArrayLike = (0, 0, 0), size: float = 1e-3) -> RigidBody:
    """A body of a millimetre without friction."""
    points = size * (np.array(list(product((0, 1), repeat=3))) - 0.5)
    return body(Shape("hull", points=points), position, velocity=velocity, material=Material(0.0, 0.0))


def test_small_bodies_stay_on_the_plane_far_from_their_start() -> None:
    """The floor of an enlarged scene ended after a metre."""
    motion = run(ground(Material(0.0, 0.0)), bolt((0, 0.0005, 0), (5.0, 0, 0)), seconds=1.2)
    assert motion.positions[-1, 0, 0] > 5.9
    np.testing.assert_allclose(motion.positions[-1, 0, 1], 0.0005, atol=2e-4)


def test_planes_reach_over_the_scene() -> None:
    def scene(*bodies: RigidBody) -> RigidScene:
        return RigidScene((ground(), *bodies), (), (0.0, -G, 0.0))

    large = body(Shape("box", (1.0, 1.0, 1.0)), (900, 0, 0))
    assert plane_reach(scene(large)) == 500
    assert choose_unit(scene(body(Shape("sphere", (1e-310,))))) == 1024
    assert plane_reach(scene(bolt(), bolt((8, 0, 0)))) >= 16
    assert choose_unit(scene(bolt(), large)) == 4  # smaller than it needs: the plane has to reach 900 m
    assert plane_reach(scene(bolt(), large)) >= 1800
    assert plane_reach(scene(large, body(Shape("box", (1.0, 1.0, 1.0)), (-900, 0, 0)))) == 3600


def test_a_note_says_where_the_plane_ends() -> None:
    moving = run(ground(Material(0.0, 0.0)), bolt((0, 0.0005, 0), (90.0, 0, 0)), seconds=0.25)
    scene = RigidScene((ground(), bolt()), (), (0.0, -G, 0.0))
    notes = find_notes(scene, skeleton([-1]), NO_CLIP, moving, 0.0, 0.0)
    assert notes == ["a body is 22.5 m from the others' start: planes end at 15.6 m for hulls"]


@pytest.mark.parametrize("units", [1.0, 64.0])
def test_bodies_without_volume_turn_alike_in_an_enlarged_world(units: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without colliders, on a drive: 2 N·m on 1 kg·m² for a second is one radian."""
    monkeypatch.setattr(world, "choose_unit", lambda scene: units)
    torque = JointDrive(angular=True, axis=2, velocity_target=100.0, damping=1e5, max_force=2.0)
    joint = RigidJoint((1, 0), (ORIGIN, ORIGIN), (JointLimit(False, (0, 1, 2), 0, 0),), (torque,), False)
    post = body(None, kind=BodyKind.STATIC)
    motion = run(post, body(None), seconds=1.0, joints=[joint], gravity=(0, 0, 0))
    angle = quaternion.angle_between(motion.rotations[-1, 0], motion.rotations[0, 0])
    np.testing.assert_allclose(angle, 1.0, rtol=1e-2)


def test_only_small_scenes_are_enlarged() -> None:
    def scene(*sizes: float) -> RigidScene:
        return RigidScene((ground(), *(body(Shape("sphere", (size,))) for size in sizes)), (), (0.0, -G, 0.0))

    assert choose_unit(scene()) == choose_unit(scene(0.1, 5.0)) == 1.0
    for radius in (0.06, 0.013, 0.002):
        units = choose_unit(scene(5.0, radius))
        assert ENLARGED_RADIUS_UNITS <= units * radius < 2 * ENLARGED_RADIUS_UNITS
        assert np.log2(units) % 1 == 0
    large = scale_scene(scene(0.01), 32.0)
    assert large.gravity == (0.0, -32 * G, 0.0)
    assert large.bodies[1].colliders[0].shape.size == (0.32,)
