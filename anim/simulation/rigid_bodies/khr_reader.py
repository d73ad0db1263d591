"""KHR_physics_rigid_bodies, in its present draft and the one with KHR_collision_shapes."""

from __future__ import annotations

import math
from typing import Any

from anim.errors import AnimError, FormatError
from anim.gltf.document import Document, json_array
from anim.model import Skeleton
from anim.simulation.rigid_bodies.description import (
    Collider,
    CollisionFilter,
    Joint,
    JointDrive,
    JointLimit,
    Material,
    Motion,
    PhysicsDescription,
    Shape,
)
from anim.simulation.rigid_bodies.extension_shapes import KHR_DEFAULTS, ShapeReader
from anim.simulation.rigid_bodies.extension_values import (
    as_fault,
    read_axes,
    read_item,
    read_number,
    read_numbers,
    read_object,
    read_objects,
    read_texts,
    read_vector,
)

NAME = "KHR_physics_rigid_bodies"
SHAPE_EXTENSIONS = ("KHR_implicit_shapes", "KHR_collision_shapes")
DRIVE_TYPES, DRIVE_MODES = ("linear", "angular"), ("force", "acceleration")


def read_khr(document: Document, skeleton: Skeleton) -> PhysicsDescription:
    """Return the bodies, colliders and joints of a document; empty without the extension.

    Raises FormatError, RangeError or UnsupportedError with the node.
    """
    root = read_object(document.json, "extensions")
    top = read_object(root, NAME)
    found = [read_object(root, name) for name in SHAPE_EXTENSIONS if name in root]
    shapes = read_objects(found[0], "shapes") if found else []
    reader = ShapeReader(document, skeleton, shapes, KHR_DEFAULTS)
    motions, colliders, joints = {}, {}, []
    for i, node in enumerate(json_array(document.json, "nodes")):
        try:
            about = read_object(read_object(node, "extensions"), NAME)
            if "motion" in about:
                motions[i] = read_motion(read_object(about, "motion"))
            if "collider" in about:
                colliders[i] = _collider(read_object(about, "collider"), top, reader)
            if "joint" in about:
                joints.append(_joint(i, read_object(about, "joint"), top, len(skeleton)))
        except AnimError as error:
            raise as_fault(error, f"{skeleton.label(i)}, {NAME}") from None
    return PhysicsDescription(motions, colliders, tuple(joints))


def read_motion(json: dict[str, Any]) -> Motion:
    """Return a motion. A mass of 0 is infinite, as is a component of the inertia."""
    mass = read_number(json, "mass", 0.0) if "mass" in json else None
    orientation = read_numbers(json, "inertiaOrientation", 4) or (0.0, 0.0, 0.0, 1.0)
    length = math.hypot(*orientation)
    if length == 0:
        raise FormatError("inertiaOrientation is zero (expected a unit quaternion)")
    x, y, z, w = (value / length for value in orientation)
    return Motion(
        bool(json.get("isKinematic", False)),
        math.inf if mass == 0 else mass,
        center_of_mass=read_vector(json, "centerOfMass"),
        inertia_diagonal=read_vector(json, "inertiaDiagonal"),
        inertia_orientation=(x, y, z, w),
        linear_velocity=read_vector(json, "linearVelocity") or (0.0, 0.0, 0.0),
        angular_velocity=read_vector(json, "angularVelocity") or (0.0, 0.0, 0.0),
        gravity_factor=read_number(json, "gravityFactor", 1.0),
    )


def _collider(json: dict[str, Any], top: dict[str, Any], reader: ShapeReader) -> Collider:
    material, own = Material(), CollisionFilter()
    if "physicsMaterial" in json:
        material = _material(
            read_item(read_objects(top, "physicsMaterials"), json["physicsMaterial"], "physics material")
        )
    if "collisionFilter" in json:
        own = _filter(read_item(read_objects(top, "collisionFilters"), json["collisionFilter"], "collision filter"))
    return Collider(_geometry(read_object(json, "geometry") or json, reader), material, own)


def _geometry(json: dict[str, Any], reader: ShapeReader) -> Shape:
    kind = "hull" if json.get("convexHull") else "mesh"
    if "shape" in json:
        return reader.shape(json["shape"])
    if "node" in json:
        return reader.node_meshes(json["node"], kind)
    if isinstance(inner := json.get("mesh"), dict):  # an older draft
        return reader.mesh(inner.get("mesh"), "hull" if inner.get("convexHull") else "mesh", inner.get("weights"))
    if "mesh" in json:
        return reader.mesh(json["mesh"], kind, json.get("weights"))
    raise FormatError("the collider has no geometry (expected shape, node or mesh)")


def _material(json: dict[str, Any]) -> Material:
    static = read_number(json, "staticFriction", 0.6)
    return Material(
        static,
        read_number(json, "dynamicFriction", 0.6),
        read_number(json, "restitution", 0.0),
        str(json.get("frictionCombine", "average")),
        str(json.get("restitutionCombine", "average")),
    )


def _filter(json: dict[str, Any]) -> CollisionFilter:
    chosen = read_texts(json, "collideWithSystems") if "collideWithSystems" in json else None
    return CollisionFilter(read_texts(json, "collisionSystems"), chosen, read_texts(json, "notCollideWithSystems"))


def _joint(node: int, json: dict[str, Any], top: dict[str, Any], count: int) -> Joint:
    connected = json.get("connectedNode")
    read_item([None] * count, connected, "node")
    assert isinstance(connected, int)
    about = read_item(read_objects(top, "physicsJoints"), json.get("joint"), "physics joint")
    limits = tuple(_limit(each) for each in read_objects(about, "limits"))
    drives = tuple(_drive(each) for each in read_objects(about, "drives"))
    return Joint(node, connected, limits, drives, bool(json.get("enableCollision", False)))


def _limit(json: dict[str, Any]) -> JointLimit:
    angular = "angularAxes" in json
    if angular == ("linearAxes" in json):
        raise FormatError("a joint's limit has linearAxes and angularAxes, or neither (expected one)")
    return JointLimit(
        angular,
        read_axes(json, "angularAxes" if angular else "linearAxes"),
        read_number(json, "min", -math.inf),
        read_number(json, "max", math.inf),
        read_number(json, "stiffness", 0.0) if "stiffness" in json else None,
        read_number(json, "damping", 0.0),
    )


def _drive(json: dict[str, Any]) -> JointDrive:
    kind, mode = json.get("type"), json.get("mode", "force")
    if kind not in DRIVE_TYPES or mode not in DRIVE_MODES:
        raise FormatError(f"a joint's drive is {kind!r}, {mode!r} (expected linear or angular, force or acceleration)")
    axis = json.get("axis")
    if type(axis) is not int:
        raise FormatError(f"a joint's drive has axis {axis!r} (expected 0, 1 or 2)")
    return JointDrive(
        kind == "angular",
        axis,
        mode == "acceleration",
        read_number(json, "maxForce", math.inf),
        read_number(json, "positionTarget", 0.0),
        read_number(json, "velocityTarget", 0.0),
        read_number(json, "stiffness", 0.0),
        read_number(json, "damping", 0.0),
    )
