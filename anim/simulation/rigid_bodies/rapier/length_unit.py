"""Length units of Rapier's world: small scenes are enlarged, since its hulls pass through each other at centimetres.

Its distances of hulls have tolerances in metres that no parameter changes. Time and mass stay, so velocities and
accelerations are scaled as lengths are, and energies and torques by the square.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from anim.simulation.rigid_bodies.description import JointDrive, JointLimit, Motion, Vector
from anim.simulation.rigid_bodies.extents import center_in_scene, scene_center, smallest_radius
from anim.simulation.rigid_bodies.rigid_scene import BodyCollider, Frame, RigidBody, RigidJoint, RigidScene
from anim.simulation.rigid_bodies.shapes import ScaledShapes

MIN_RADIUS_M = 0.0625  # of the smallest moving body, below which a scene is enlarged; hulls fail at a third of it
ENLARGED_RADIUS_UNITS = 0.25  # at least, of that body then
MAX_UNITS_PER_METRE = 1024.0
MIN_PLANE_REACH_M = 500.0  # half the size of the box that stands for a plane where hulls fall
MAX_PLANE_REACH_UNITS = 8000.0  # at 32 000 Rapier lets hulls sink into it
PLANE_REACH_PER_SPREAD = 4.0  # of the bodies at the start; they move farther


def choose_unit(scene: RigidScene) -> float:
    """Return length units per metre: 1, or for small moving bodies the power of two that makes them large enough."""
    least = smallest_radius(scene, 1.0)
    if least >= MIN_RADIUS_M:
        return 1.0
    most = MAX_PLANE_REACH_UNITS / (PLANE_REACH_PER_SPREAD * max(_spread(scene), 1.0))
    wanted = min(ENLARGED_RADIUS_UNITS / max(least, ENLARGED_RADIUS_UNITS / MAX_UNITS_PER_METRE), MAX_UNITS_PER_METRE)
    exponent = min(math.ceil(math.log2(wanted)), math.floor(math.log2(most)))
    return min(max(2.0**exponent, 1.0), MAX_UNITS_PER_METRE)


def plane_reach(scene: RigidScene) -> float:
    """Return the distance in metres from the bodies to the end of a plane where hulls fall. scene: in metres."""
    units = choose_unit(scene)
    wanted = units * max(MIN_PLANE_REACH_M, PLANE_REACH_PER_SPREAD * _spread(scene))
    return min(wanted, MAX_PLANE_REACH_UNITS) / units


def _spread(scene: RigidScene) -> float:
    """Largest distance in metres of a moving body from the middle of all."""
    center = scene_center(scene)
    return max(
        (float(np.linalg.norm(center_in_scene(scene.bodies[i], scene.extents) - center)) for i in scene.moving),
        default=0.0,
    )


def scale_scene(scene: RigidScene, units: float) -> RigidScene:
    """Return a scene with `units` length units per metre."""
    if units == 1.0:
        return scene
    shapes = ScaledShapes()
    return RigidScene(
        tuple(_scale_body(each, units, shapes) for each in scene.bodies),
        tuple(_scale_joint(each, units) for each in scene.joints),
        _scale(scene.gravity, units),
    )


def _scale_body(body: RigidBody, units: float, shapes: ScaledShapes) -> RigidBody:
    return replace(
        body,
        frame=_scale_frame(body.frame, units),
        colliders=tuple(_scale_collider(each, units, shapes) for each in body.colliders),
        motion=_scale_motion(body.motion, units),
        linear_velocity=units * body.linear_velocity,
        radius=units * body.radius,
    )


def _scale_collider(collider: BodyCollider, units: float, shapes: ScaledShapes) -> BodyCollider:
    shape = shapes.scale(collider.shape, units * np.eye(3))
    return replace(collider, shape=shape, frame=_scale_frame(collider.frame, units))


def _scale_motion(motion: Motion, units: float) -> Motion:
    center, inertia = motion.center_of_mass, motion.inertia_diagonal
    return replace(
        motion,
        density=motion.density / units**3,
        center_of_mass=None if center is None else _scale(center, units),
        inertia_diagonal=None if inertia is None else _scale(inertia, units**2),
        linear_velocity=(0.0, 0.0, 0.0),  # the body has it, in the scene's space
    )


def _scale_joint(joint: RigidJoint, units: float) -> RigidJoint:
    first, second = (_scale_frame(each, units) for each in joint.frames)
    return replace(
        joint,
        frames=(first, second),
        limits=tuple(_scale_limit(each, units) for each in joint.limits),
        drives=tuple(_scale_drive(each, units) for each in joint.drives),
    )


def _scale_limit(limit: JointLimit, units: float) -> JointLimit:
    if not limit.angular:
        return replace(limit, min=units * limit.min, max=units * limit.max)
    stiffness = None if limit.stiffness is None else units**2 * limit.stiffness
    return replace(limit, stiffness=stiffness, damping=units**2 * limit.damping)


def _scale_drive(drive: JointDrive, units: float) -> JointDrive:
    """A drive's numbers: stiffness in N/m stays, that in N·m/rad doesn't, unless it gives an acceleration."""
    if not drive.angular:
        return replace(
            drive,
            max_force=units * drive.max_force,
            position_target=units * drive.position_target,
            velocity_target=units * drive.velocity_target,
        )
    factor = 1.0 if drive.acceleration else units**2
    return replace(
        drive,
        max_force=units**2 * drive.max_force,
        stiffness=factor * drive.stiffness,
        damping=factor * drive.damping,
    )


def _scale_frame(frame: Frame, units: float) -> Frame:
    return replace(frame, position=units * frame.position)


def _scale(vector: Vector, factor: float) -> Vector:
    x, y, z = vector
    return (factor * x, factor * y, factor * z)
