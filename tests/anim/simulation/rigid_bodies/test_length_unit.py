"""Small bodies in enlarged worlds: the same motion, and hulls of centimetres that stay on each other."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from anim.simulation.rigid_bodies.description import Material, Motion, Shape
from anim.simulation.rigid_bodies.rapier import world
from anim.simulation.rigid_bodies.rapier.length_unit import ENLARGED_RADIUS_UNITS, choose_unit, scale_scene
from anim.simulation.rigid_bodies.rigid_scene import RigidScene
from tests.anim.simulation.rigid_bodies.cases import G, body, ground, needs_rapier, path, run
from tests.anim.simulation.rigid_bodies.test_joints import LOCKED, NO_TURN, swing

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
