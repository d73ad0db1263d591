"""Colliders of rigid bodies as obstacles of particles: spheres, boxes, capsules and planes."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.errors import DataRangeError, NotFoundError, RangeError
from anim.gltf.document import Document
from anim.model import Skeleton
from anim.sampling import rest_world
from anim.simulation.cloth.colliders import Capsule, Plane
from anim.simulation.particles.obstacles import Box, Obstacle, Sphere
from anim.simulation.rigid_bodies.description import Shape
from anim.simulation.rigid_bodies.simulate import read_description


def read_rigid_colliders(document: Document, skeleton: Skeleton) -> tuple[list[Obstacle], list[int]]:
    """Return the colliders of KHR_physics_rigid_bodies or OMI_physics_body, and the nodes of those of other shapes.

    Sizes have the scale of the nodes at rest. Raises NotFoundError without any that is an obstacle,
    DataRangeError for one beyond the limits.
    """
    found: list[Obstacle] = []
    others = []
    scales = np.linalg.norm(rest_world(skeleton)[..., :3], axis=-2)
    for node, collider in read_description(document, skeleton).colliders.items():
        try:
            made = _obstacle(collider.shape, node, scales[node])
        except RangeError as error:
            raise DataRangeError(error.problem, where=f"collider of {skeleton.label(node)}") from None
        if made is None:
            others.append(node)
        else:
            found.append(made)
    if not found:
        raise NotFoundError("the file has no spheres, boxes, capsules or planes of KHR_physics_rigid_bodies")
    return found, others


def _obstacle(shape: Shape, node: int, scale: Floats) -> Obstacle | None:
    x, y, z = shape.center
    if shape.kind == "sphere":
        return Sphere(shape.center, shape.size[0] * float(scale.max()), node)
    if shape.kind == "box":
        width, height, depth = (np.array(shape.size) * scale).tolist()
        return Box(shape.center, (width, height, depth), node)
    if shape.kind == "plane":
        return Plane(shape.center, (0.0, 1.0, 0.0), node)
    if shape.kind == "capsule" and shape.size[1] == shape.size[2]:
        half, radius = shape.size[0] / 2, shape.size[1] * float(max(scale[0], scale[2]))
        return Capsule((x, y - half, z), (x, y + half, z), radius, node, node)
    return None
