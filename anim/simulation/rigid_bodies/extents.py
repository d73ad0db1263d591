"""Spheres around bodies, wherever the origin of their node is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.simulation.rigid_bodies.rigid_scene import RigidBody, RigidScene
from anim.simulation.rigid_bodies.shape_extents import ShapeExtents


class BoundingSphere(NamedTuple):
    """Sphere around a body: center (3,) m in its own frame, and radius m."""

    center: Floats
    radius: float


def body_extent(body: RigidBody, extents: ShapeExtents) -> BoundingSphere:
    """Return a sphere around the colliders of a body, in the body's frame; of radius 0 without one, or for a plane.

    extents: those of the body's scene.
    """
    if not body.colliders:
        return BoundingSphere(np.zeros(3), 0.0)
    own = [extents.of(each.shape) for each in body.colliders]
    frames = [each.frame for each in body.colliders]
    centers = np.array([f.position + quaternion.rotate(f.rotation, s.center) for f, s in zip(frames, own, strict=True)])
    radii = np.array([each.radius for each in own])
    center = ((centers - radii[:, None]).min(axis=0) + (centers + radii[:, None]).max(axis=0)) / 2
    return BoundingSphere(center, float((np.linalg.norm(centers - center, axis=1) + radii).max()))


def center_in_scene(body: RigidBody, extents: ShapeExtents) -> Floats:
    """Return the middle (3,) m of a body in the scene, at the start."""
    return np.asarray(body.frame.position + quaternion.rotate(body.frame.rotation, body_extent(body, extents).center))


def scene_center(scene: RigidScene) -> Floats:
    """Return the mean position (3,) m of the moving bodies at the start."""
    centers = [center_in_scene(scene.bodies[i], scene.extents) for i in scene.moving]
    return np.asarray(np.mean(centers, axis=0)) if centers else np.zeros(3)


def smallest_radius(scene: RigidScene, default: float) -> float:
    """Return the radius of the smallest moving body with a shape, in metres; `default` if there is none."""
    radii = [body_extent(scene.bodies[i], scene.extents).radius for i in scene.moving]
    return min((each for each in radii if each > 0), default=default)
