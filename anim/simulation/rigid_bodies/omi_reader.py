"""OMI_physics_body and OMI_physics_shape, which Godot writes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from anim.errors import AnimError, FormatError
from anim.gltf.document import Document, json_array
from anim.model import Skeleton
from anim.simulation.rigid_bodies.description import Collider, Motion, PhysicsDescription
from anim.simulation.rigid_bodies.extension_shapes import OMI_DEFAULTS, ShapeReader
from anim.simulation.rigid_bodies.extension_values import as_fault, read_number, read_object, read_objects, read_vector
from anim.simulation.rigid_bodies.khr_reader import read_motion

NAME, SHAPES = "OMI_physics_body", "OMI_physics_shape"
TYPES = ("static", "kinematic", "dynamic")


def read_omi(document: Document, skeleton: Skeleton) -> PhysicsDescription:
    """Return the bodies and colliders of a document; empty without the extension.

    A static motion is none. Raises FormatError, RangeError or UnsupportedError with the node.
    """
    shapes = read_objects(read_object(read_object(document.json, "extensions"), SHAPES), "shapes")
    reader = ShapeReader(document, skeleton, shapes, OMI_DEFAULTS)
    motions, colliders = {}, {}
    for i, node in enumerate(json_array(document.json, "nodes")):
        try:
            about = read_object(read_object(node, "extensions"), NAME)
            if "motion" in about and (motion := _motion(read_object(about, "motion"))) is not None:
                motions[i] = motion
            if "collider" in about:
                colliders[i] = Collider(reader.shape(read_object(about, "collider").get("shape")))
        except AnimError as error:
            raise as_fault(error, f"{skeleton.label(i)}, {NAME}") from None
    return PhysicsDescription(motions, colliders)


def _motion(json: dict[str, Any]) -> Motion | None:
    kind = json.get("type")
    if kind not in TYPES:
        raise FormatError(f"type is {kind!r} (expected static, kinematic or dynamic)")
    if kind == "static":
        return None
    is_given = any(read_vector(json, "inertiaDiagonal") or ())  # zeros are Godot's for none
    known = {key: value for key, value in json.items() if key != "inertiaDiagonal" or is_given}
    motion = replace(read_motion(known), kinematic=kind == "kinematic")
    return replace(motion, mass=read_number(json, "mass", 1.0) or 1.0)
