"""Rigid bodies in world space at the start of a simulation: the input of an engine."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from anim.arrays import Floats
from anim.simulation.rigid_bodies.description import (
    CollisionFilter,
    JointDrive,
    JointLimit,
    Material,
    Motion,
    Shape,
    Vector,
)
from anim.simulation.rigid_bodies.shape_extents import ShapeExtents

WORLD = -1  # index of the body that joints to no body refer to


class BodyKind(StrEnum):
    """Source of a body's motion: forces, nothing, its own constant velocity, or the driving clip."""

    DYNAMIC = "dynamic"
    STATIC = "static"
    KINEMATIC = "kinematic"
    ANIMATED = "animated"


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """Rigid transform: position (3,) m, rotation (4,) unit xyzw."""

    position: Floats
    rotation: Floats


@dataclass(frozen=True, slots=True, eq=False)
class BodyCollider:
    """Collider in its body's frame, its shape scaled. node: −1 for the floor."""

    node: int
    shape: Shape
    frame: Frame
    material: Material
    filter: CollisionFilter


@dataclass(frozen=True, slots=True, eq=False)
class RigidBody:
    """Body at the start. node: −1 for the floor. Velocities are in world space."""

    node: int
    kind: BodyKind
    frame: Frame
    colliders: tuple[BodyCollider, ...]
    motion: Motion
    linear_velocity: Floats
    angular_velocity: Floats
    radius: float


@dataclass(frozen=True, slots=True, eq=False)
class RigidJoint:
    """Joint of two bodies, by index, or WORLD; the frames are in those of the bodies."""

    bodies: tuple[int, int]
    frames: tuple[Frame, Frame]
    limits: tuple[JointLimit, ...]
    drives: tuple[JointDrive, ...]
    enable_collision: bool


@dataclass(frozen=True, slots=True, eq=False)
class RigidScene:
    """Bodies, joints and gravity (m/s²). extents: of the bodies' shapes, as far as they were asked for."""

    bodies: tuple[RigidBody, ...]
    joints: tuple[RigidJoint, ...]
    gravity: Vector
    extents: ShapeExtents = field(default_factory=ShapeExtents)

    @property
    def moving(self) -> list[int]:
        """Indices of the bodies that the simulation moves."""
        return [i for i, body in enumerate(self.bodies) if body.kind in (BodyKind.DYNAMIC, BodyKind.KINEMATIC)]

    @property
    def animated(self) -> list[int]:
        """Indices of the bodies that the driving clip moves."""
        return [i for i, body in enumerate(self.bodies) if body.kind is BodyKind.ANIMATED]

    @property
    def can_repeat(self) -> bool:
        """True if a clip, a motor or its own constant velocity moves a body: others only come to rest."""
        return any(body.kind in (BodyKind.ANIMATED, BodyKind.KINEMATIC) for body in self.bodies) or any(
            joint.drives for joint in self.joints
        )
