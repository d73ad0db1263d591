"""Test files of KHR_physics_rigid_bodies, as their READMEs describe what must happen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from anim.maths import quaternion
from anim.simulation.rigid_bodies.simulate import RigidRun
from tests.anim.simulation.rigid_bodies.cases import Array, G, needs_rapier, path, simulate
from tests.files import ASSETS, opened_path

FOLDER = ASSETS / "physics"
pytestmark = [needs_rapier, pytest.mark.skipif(not FOLDER.is_dir(), reason="shared/assets is not there")]


def play(kind: str, number: int, **options: float) -> RigidRun:
    return simulate(opened_path(_file(kind, number)), **options)


def _file(kind: str, number: int) -> Path:
    return FOLDER / kind / f"RigidBodies_{kind}_{number:02}.gltf"


@pytest.mark.parametrize("number", range(36))
def test_a_body_is_supported_by_the_static_one(number: int) -> None:
    """The static shapes reach up to y = −0.5 or higher; the body falls from y = 3 on it and comes to rest."""
    run = play("ColliderTypeMatrix", number)
    positions = run.tracks[0].values
    assert positions[:, 1].min() > -0.55
    assert np.abs(positions[-1, [0, 2]]).max() < 3
    assert run.report.figures["bodies"] == run.report.figures["static"] == 1
    assert run.report.figures["max_speed_m_s"] > 4
    assert run.report.figures["impacts"] in (1, 2)  # a key at its time, whatever the shapes


def _apex(height: Array) -> float:
    """The largest height between the first and the second impact."""
    low = int(np.argmin(height[:70]))
    return float(height[low : low + 70].max())


def test_high_restitution_bounces_higher() -> None:
    run = play("Materials", 0)
    after = [_apex(path(run, node)[:, 1]) for node in (0, 1)]  # radius 1, from 5 m
    # maximum of 0 and 0.5, and of 1 and 0.5: but the floor's mode is average, which counts first
    expected = [1 + 4 * 0.25**2, 1 + 4 * 0.75**2]
    np.testing.assert_allclose(after, expected, atol=0.1)


def test_combine_modes_count_by_their_order() -> None:
    run = play("Materials", 1)
    for node in (0, 1):  # the floor has 0 and average, which counts before minimum and maximum
        assert _apex(path(run, node)[:, 1]) == pytest.approx(1 + 4 * 0.25**2, abs=0.1)


def test_low_friction_slides_and_high_friction_sticks() -> None:
    run = play("Materials", 2, duration=1.0)
    slid, stuck = (path(run, node) for node in (0, 1))
    # friction 0 and that of the floor, 0.6, average to 0.3 on 45°
    acceleration = G * np.sin(np.pi / 4) * (1 - 0.3)
    assert np.linalg.norm(slid[-1] - slid[0]) == pytest.approx(acceleration / 2, rel=0.02)
    assert np.linalg.norm(stuck[-1] - stuck[0]) < 0.02


@pytest.mark.parametrize(
    ("number", "node", "velocity", "spin"),
    [
        (0, 0, (0, 0, 0), (0, 0, 0)),
        (1, 0, (1, 0, 0), (0, 0, 0)),
        (2, 0, (0, 0, 0), (1, 0, 0)),
        (3, 1, (0, 0, 1), (0, 0, 0)),
        (4, 1, (0, 0, 0), (0, 0, 1)),
    ],
)
def test_velocities_without_gravity_stay(
    number: int, node: int, velocity: tuple[float, ...], spin: tuple[float, ...]
) -> None:
    run = play("MotionProperties", number, duration=2.0)
    moved = path(run, node)
    np.testing.assert_allclose(moved[-1] - moved[0], 2 * np.array(velocity), atol=1e-3)
    turned = path(run, node, "rotation")
    angle = quaternion.rotation_vector(quaternion.multiply(quaternion.conjugate(turned[0]), turned[-1]))
    np.testing.assert_allclose(angle, 2 * np.array(spin), atol=1e-3)


def test_a_kinematic_body_does_not_fall() -> None:
    moved = path(play("MotionProperties", 5), 1)
    np.testing.assert_allclose(moved, np.broadcast_to([0, 0.5, 0], moved.shape), atol=1e-6)


def test_a_heavy_box_pushes_a_light_one_and_keeps_its_speed() -> None:
    run = play("MotionProperties", 6, duration=2.0)
    speeds = [float((path(run, node)[-1] - path(run, node)[-2])[0] * 60) for node in range(4)]
    light, heavy, pushed_by_light, pushed_by_heavy = speeds
    assert light < 3
    assert heavy == pytest.approx(5, abs=0.2)
    assert pushed_by_heavy > pushed_by_light + 1.5
    assert 1 * light + 1 * pushed_by_light == pytest.approx(5, abs=0.02)
    assert 100 * heavy + 1 * pushed_by_heavy == pytest.approx(500, abs=0.5)


def test_infinite_inertia_does_not_rotate() -> None:
    turned = path(play("MotionProperties", 7), 1, "rotation")
    np.testing.assert_allclose(turned, np.broadcast_to([0, 0, 0, 1], turned.shape), atol=1e-6)
