"""Limit of distances in a scene: the engine computes in float32, and doesn't end a step of bodies 1e15 m apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.errors import UnsupportedError
from anim.model import Skeleton
from anim.simulation.rigid_bodies.extents import center_in_scene, scene_center
from anim.simulation.rigid_bodies.rigid_scene import RigidBody, RigidScene

MAX_DISTANCE_M = 1e7  # 10 000 km: steps of float32 are a metre there


def check_start(scene: RigidScene, skeleton: Skeleton) -> None:
    """Raise UnsupportedError where a body begins too far from the middle of the moving ones."""
    positions = np.array([center_in_scene(body, scene.extents) for body in scene.bodies])
    _check(positions[None], scene.bodies, scene_center(scene), skeleton)


def check_animated(positions: Floats, scene: RigidScene, skeleton: Skeleton) -> None:
    """Raise UnsupportedError where a clip moves a body too far. positions: (S, n, 3) m, of `scene.animated`."""
    _check(positions, [scene.bodies[i] for i in scene.animated], scene_center(scene), skeleton)


def _check(positions: Floats, bodies: Sequence[RigidBody], center: Floats, skeleton: Skeleton) -> None:
    distances = np.linalg.norm(positions - center, axis=-1).max(axis=0)
    for body, distance in zip(bodies, distances.tolist(), strict=True):
        if not distance <= MAX_DISTANCE_M:
            limit = f"{MAX_DISTANCE_M / 1000:_.0f}".replace("_", " ")
            name = "the floor" if body.node < 0 else skeleton.label(body.node)
            raise UnsupportedError(
                f"{name} is {distance / 1000:.3g} km away from the middle of the moving bodies (limit {limit} km: "
                "steps of float32 are a metre there)",
                help="move it nearer, or leave it out of the bodies",
            )
