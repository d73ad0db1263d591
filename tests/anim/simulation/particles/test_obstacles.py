"""Capsules, planes and colliders that keep particles inside, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from anim.model import Clip, Interpolation, Skeleton, Track
from anim.simulation.cloth.colliders import Capsule, Plane
from anim.simulation.particles.node_motion import NodeMotion
from anim.simulation.particles.obstacles import Sphere
from anim.simulation.particles.solver import Contact
from tests.anim.simulation.particles.test_forces_and_contacts import NO_GRAVITY, G, run

SMOOTH = Contact(1.0, 0.0)
STILL = Contact(0.0, 1.0)


def test_a_capsule_is_hit_at_its_side_and_at_its_end() -> None:
    """A capsule along x from −1 to 1: the side is 0.5 above its axis, the ball at its end is rounder."""
    capsule = Capsule((-1, 0, 0), (1, 0, 0), 0.5)
    keys = run([(0.3, 2, 0), (1.3, 2, 0)], [(0, -1, 0), (0, -1, 0)], capsule, forces=NO_GRAVITY, seconds=1.8)
    side, end = (keys.positions[keys.particles == i] for i in (0, 1))
    np.testing.assert_allclose(side[1], [0.3, 0.5, 0], atol=1e-9)
    np.testing.assert_allclose(end[1], [1.3, 0.4, 0], atol=1e-9)


def test_a_capsule_reflects_about_its_normal() -> None:
    capsule = Capsule((-1, 0, 0), (1, 0, 0), 0.5)
    keys = run([(1.3, 2, 0)], [(0, -1, 0)], capsule, forces=NO_GRAVITY, contact=SMOOTH, seconds=1.8)
    normal, before = np.array([0.6, 0.8, 0]), np.array([0, -1.0, 0])
    np.testing.assert_allclose(keys.out_velocities[1], before - 2 * normal * (before @ normal), atol=1e-9)


def test_a_ball_of_equal_ends_is_a_sphere() -> None:
    found = [
        run([(0.2, 2, 0.1)], [(0, -1, 0)], each, contact=SMOOTH, seconds=2.0)
        for each in (Sphere((0, 0, 0), 0.5), Capsule((0, 0, 0), (0, 0, 0), 0.5))
    ]
    np.testing.assert_array_equal(found[0].positions, found[1].positions)


@pytest.mark.parametrize(
    "shape",
    [Capsule((0, 0, 0), (0, 0, 0), 1.0, None, None, True), Capsule((-1, 0, 0), (1, 0, 0), 1.0, None, None, True)],
)
def test_particles_stay_inside_of_a_collider(shape: Capsule) -> None:
    random = np.random.default_rng(0)
    speeds = [tuple(each) for each in random.uniform(-4, 4, (30, 3)).tolist()]
    keys = run([(0, 0, 0)] * 30, speeds, shape, contact=Contact(0.9, 0.1), seconds=2.0)
    x = keys.positions
    axis = np.stack([np.clip(x[:, 0], shape.start[0], shape.end[0]), 0 * x[:, 0], 0 * x[:, 0]], axis=1)
    assert np.linalg.norm(x - axis, axis=1).max() < 1 + 1e-6
    assert keys.num_impacts > 60


def test_a_plane_that_leans_is_an_incline_with_friction() -> None:
    """It slides at g (sin − µ cos) along the slope, or stays if µ is above the tangent."""
    angle = np.radians(30)
    normal = (float(np.sin(angle)), float(np.cos(angle)), 0.0)
    for friction in (0.2, 0.7):
        keys = run([(0, 1e-4, 0)], [(0, 0, 0)], Plane((0, 0, 0), normal), contact=Contact(0.0, friction), seconds=1.0)
        slid = float(np.linalg.norm(keys.positions[-1] - [0, 1e-4, 0]))
        expected = 0.5 * max(G * (np.sin(angle) - friction * np.cos(angle)), 0.0)
        assert slid == pytest.approx(expected, rel=0.02, abs=2e-3)
        assert abs(keys.positions[-1] @ normal) < 1e-6


def test_a_capsule_between_two_nodes_follows_both() -> None:
    """A bar between two nodes that rise by 1 m/s lifts a particle with it."""
    skeleton = Skeleton(
        ("a", "b"),
        np.array([-1, -1]),
        np.array([[-1.0, 0, 0], [1, 0, 0]]),
        np.tile([0.0, 0, 0, 1], (2, 1)),
        np.ones((2, 3)),
    )
    rise = [
        Track(i, "translation", Interpolation.LINEAR, np.array([0.0, 1.0]), np.array([[x, 0, 0], [x, 1.0, 0]]))
        for i, x in ((0, -1.0), (1, 1.0))
    ]
    bar = Capsule((0, 0, 0), (0, 0, 0), 0.25, 0, 1)
    motion = NodeMotion(skeleton, Clip("rise", tuple(rise)))
    keys = run([(0.3, 0.25 + 1e-6, 0)], [(0, 0, 0)], bar, contact=STILL, motion=motion, seconds=0.9)
    np.testing.assert_allclose(keys.positions[-1], [0.3, 1.15, 0], atol=1e-3)
