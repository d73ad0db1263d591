"""Shapes and masses of colliders in Rapier."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.errors import FormatError, UnsupportedError
from anim.maths import quaternion
from anim.simulation.rigid_bodies.description import Shape
from anim.simulation.rigid_bodies.rapier.frames import isometry, shape_frame
from anim.simulation.rigid_bodies.rapier.package import load_package
from anim.simulation.rigid_bodies.rigid_scene import BodyCollider, BodyKind, RigidBody, RigidScene

INFINITE_MASS_KG = 1e9
PLANE_DEPTH = 50.0  # half of it, of a plane's box, in length units
CONVEX_VOLUME_FRACTION = 0.99  # of its hull, from which a mesh counts as convex
NEEDLE_WIDTH = 0.01  # of the length of a mesh, below which it is not divided
# Area of a mesh's triangles, in squares of its size, that is divided into convex pieces, which takes 65 ms each: a
# closed surface has about 2, triangles that cross each other any number.
MAX_AREA, MAX_AREA_OF_SCENE = 25.0, 250.0


class ShapeBuilder:
    """Builder of Rapier's shapes for the colliders of a scene, and of the masses of its bodies."""

    def __init__(
        self, scene: RigidScene, center: Floats, reach: float, units: float, label: Callable[[int], str]
    ) -> None:
        """center: (3,), near the bodies. reach: half the size of a plane's box. units: of length, per metre.

        label: of a node, for messages.
        """
        self._label = label
        self._rapier, self._scene, self._center = load_package(), scene, center
        self._reach, self._units = reach, units
        self._has_hulls = any(each.shape.kind in ("hull", "mesh") for body in scene.bodies for each in body.colliders)
        self._of_points: dict[tuple[Shape, bool], Any] = {}  # colliders with the same shape share Rapier's
        self._solids: dict[tuple[Shape, float], Any] = {}
        self._area = 0.0  # of the meshes that were divided

    def build(self, collider: BodyCollider, body: RigidBody) -> Any:
        """Rapier's shape. A dynamic mesh, which has no inside, becomes its hull, or convex pieces of it."""
        shape, make = collider.shape, self._rapier.SharedShape
        if shape.kind == "sphere":
            return make.ball(*shape.size)
        if shape.kind == "box":
            return make.cuboid(*(length / 2 for length in shape.size))
        if shape.kind == "plane":
            return self._plane(collider, body)
        if shape.kind in ("capsule", "cylinder"):
            height, radius, _ = shape.size
            return (make.capsule_y if shape.kind == "capsule" else make.cylinder)(height / 2, radius)
        key = shape, body.kind is BodyKind.DYNAMIC
        if key not in self._of_points:
            self._of_points[key] = self._shape_of_points(collider, is_dynamic=key[1])
        return self._of_points[key]

    def _shape_of_points(self, collider: BodyCollider, *, is_dynamic: bool) -> Any:
        shape, make = collider.shape, self._rapier.SharedShape
        points, faces = shape.points.astype(np.float32), shape.faces.astype(np.uint32)
        if shape.kind == "hull":
            return self._hull(points, collider)
        if not is_dynamic:
            return make.trimesh(points, faces)
        areas = _areas(points, faces)
        if not areas.any():
            raise self._flat(collider)
        corners = points[np.unique(faces[areas > 0])]
        hull = self._hull(corners, collider)
        is_convex = _volume(make.trimesh(points, faces)) >= CONVEX_VOLUME_FRACTION * _volume(hull)
        if is_convex or _is_needle(corners):
            return hull
        self._check_area(areas, points, collider)
        return make.convex_decomposition(points, faces)

    def _check_area(self, areas: Floats, points: Any, collider: BodyCollider) -> None:
        """Raise UnsupportedError for triangles that would take minutes to divide."""
        area = float(areas.sum()) / float(np.ptp(points, axis=0).max()) ** 2
        self._area += area
        if area > MAX_AREA or self._area > MAX_AREA_OF_SCENE:
            which, found, most = f"the mesh of {self._label(collider.node)} is", area, MAX_AREA
            if area <= MAX_AREA:
                which, found, most = "all concave dynamic meshes together are", self._area, MAX_AREA_OF_SCENE
            raise UnsupportedError(
                f"{which} too large to divide into convex pieces: area {found:.3g} (limit {most:g}, in squares of each "
                "mesh's size)",
                help="choose its hull: `shape` hull, or convexHull in the file",
            )

    def _plane(self, collider: BodyCollider, body: RigidBody) -> Any:
        """A half-space; where hulls fall, which topple on it (Rapier 0.36), the top of a large box under the bodies."""
        make = self._rapier.SharedShape
        if body.kind is BodyKind.DYNAMIC or not self._has_hulls:
            return make.halfspace((0.0, 1.0, 0.0))
        x, z = self._beside(collider, body) if body.kind is BodyKind.STATIC else (0.0, 0.0)
        down = self._rapier.Isometry3(translation=(x, -PLANE_DEPTH, z))
        return make.compound([(down, make.cuboid(self._reach, PLANE_DEPTH, self._reach))])

    def _beside(self, collider: BodyCollider, body: RigidBody) -> tuple[float, float]:
        """Position of the bodies along a plane's own x and z."""
        own = shape_frame(collider)
        back = quaternion.conjugate(quaternion.multiply(body.frame.rotation, own.rotation))
        origin = body.frame.position + quaternion.rotate(body.frame.rotation, own.position)
        x, _, z = quaternion.rotate(back, self._center - origin).tolist()
        return x, z

    def _hull(self, points: Any, collider: BodyCollider) -> Any:
        if np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[-1] <= 1e-6 * np.ptp(points):
            raise self._flat(collider)
        try:
            return self._rapier.SharedShape.convex_hull(points)
        except Exception:  # the package raises a plain one
            raise self._flat(collider) from None

    def _flat(self, collider: BodyCollider) -> FormatError:
        problem = f"the collider of {self._label(collider.node)} is flat: its hull has no volume"
        return FormatError(problem, help="give its mesh a thickness")

    def mass(self, body: RigidBody, shapes: list[Any]) -> Any:
        """Mass, center and inertia: those of the colliders, unless the motion gives its own."""
        rapier, motion = self._rapier, body.motion
        total = rapier.MassProperties.zero()
        for each, shape in zip(body.colliders, shapes, strict=True):
            total = total + self._solid(each, shape, motion.density).transform_by(isometry(shape_frame(each)))
        volume = total.mass
        mass = motion.mass if motion.mass is not None else volume
        mass = INFINITE_MASS_KG if math.isinf(mass) else (mass or 1.0)
        factor = mass / volume if volume else 1.0
        without = [mass * self._units**2] * 3  # 1 m² per kg, for bodies without a volume
        inertia = [factor * value for value in total.principal_inertia.to_tuple()] if volume else without
        turned = total.principal_inertia_local_frame if volume else rapier.Rotation3()
        if motion.inertia_diagonal is not None:
            x, y, z, w = motion.inertia_orientation
            inertia, turned = list(motion.inertia_diagonal), rapier.Rotation3(w=w, x=x, y=y, z=z)
        center = total.local_com.to_tuple() if motion.center_of_mass is None else motion.center_of_mass
        return rapier.MassProperties(tuple(center), mass, tuple(inertia), turned)

    def _solid(self, collider: BodyCollider, shape: Any, density: float) -> Any:
        """Mass of one collider; of a closed mesh, and not of its convex pieces, which overlap a little."""
        key = collider.shape, density
        if key not in self._solids:
            self._solids[key] = self._weigh(collider, shape).mass_properties(density)
        return self._solids[key]

    def _weigh(self, collider: BodyCollider, shape: Any) -> Any:
        if collider.shape.kind != "mesh":
            return shape
        points, faces = collider.shape.points.astype(np.float32), collider.shape.faces.astype(np.uint32)
        solid = self._rapier.SharedShape.trimesh(points, faces)
        is_closed = 0 < _volume(solid) <= _volume(shape) * 1.5
        return solid if is_closed else shape


def _areas(points: Any, faces: Any) -> Floats:
    """Areas (T,) of triangles."""
    first, second, third = (points[faces[:, k]].astype(np.float64) for k in range(3))
    return np.asarray(np.linalg.norm(np.cross(second - first, third - first), axis=1) / 2)


def _is_needle(points: Any) -> bool:
    """True for points near a line, for whose pieces Rapier's grid is too coarse: it panics without one."""
    lengths = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(lengths[1] < NEEDLE_WIDTH * lengths[0])


def _volume(shape: Any) -> float:
    return float(shape.mass_properties(1.0).mass)
