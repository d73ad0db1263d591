"""Engine Rapier: scenes become its world, centered, in float32. This module is the interface of the package.

Small scenes are enlarged in it, see `length_unit`; all that goes in and comes out is in metres.

Rapier solves each step in SUBSTEPS substeps of symplectic Euler, which moves a free fall ½·g·t·h/SUBSTEPS ahead of
its parabola. All velocities begin half a substep earlier, as in leapfrog; then a free flight is exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.simulation.rigid_bodies.description import MAX_SPEED_M_S
from anim.simulation.rigid_bodies.extents import body_extent, scene_center, smallest_radius
from anim.simulation.rigid_bodies.rapier.filters import interaction_groups
from anim.simulation.rigid_bodies.rapier.frames import isometry, shape_frame
from anim.simulation.rigid_bodies.rapier.friction import FrictionHooks
from anim.simulation.rigid_bodies.rapier.joints import build_joint, find_approximations
from anim.simulation.rigid_bodies.rapier.length_unit import choose_unit, plane_reach, scale_scene
from anim.simulation.rigid_bodies.rapier.package import load_package
from anim.simulation.rigid_bodies.rapier.shapes import INFINITE_MASS_KG, ShapeBuilder
from anim.simulation.rigid_bodies.rapier.slip import SlipReader
from anim.simulation.rigid_bodies.rigid_scene import BodyCollider, BodyKind, Frame, RigidBody, RigidScene

__all__ = ["RapierWorld", "find_approximations", "plane_reach"]

SUBSTEPS = 4
MAX_PENETRATION_M = 0.005  # that Rapier leaves; of small bodies MAX_PENETRATION_PER_RADIUS
MAX_PENETRATION_PER_RADIUS, MIN_PENETRATION_M = 0.01, 1e-5
MAX_RECYCLED_M = 1e-3  # motion since the distances of contacts were measured; impacts need those of the step


class RapierWorld:
    """World of a scene's bodies. step: s. label: of a node, for messages.

    States are those of `scene.moving`, in this order.
    """

    def __init__(self, scene: RigidScene, step: float, label: Callable[[int], str] = "node {}".format) -> None:
        self._rapier = load_package()
        self._units = choose_unit(scene)
        reach = self._units * plane_reach(scene)
        self._scene = scene = scale_scene(scene, self._units)
        self._center = np.round(scene_center(scene))
        world = self._rapier.PhysicsWorld(gravity=scene.gravity)
        self._world = world
        parameters = world.integration_parameters
        parameters.dt, parameters.num_solver_iterations = step, SUBSTEPS
        parameters.normalized_contact_recycle_distance = MAX_RECYCLED_M
        parameters.contact_softness = parameters.static_contact_softness  # bodies sink half as deep into each other
        parameters.normalized_allowed_linear_error = _allowed_penetration(scene)
        parameters.normalized_max_linear_velocity = self._units * MAX_SPEED_M_S  # its own is 400 m/s
        self._early = -0.5 * step / SUBSTEPS * np.array(scene.gravity)
        self._groups = interaction_groups(scene)
        self._shapes = ShapeBuilder(scene, self._center, reach, self._units, label)
        materials = [each.material for body in scene.bodies for each in body.colliders]
        self._friction = FrictionHooks(materials, step, self._units)
        self._colliders: dict[int, tuple[int, BodyCollider]] = {}
        self._handles = [self._add_body(i, body) for i, body in enumerate(scene.bodies)]
        self._bodies = [world.rigid_bodies[handle] for handle in self._handles]
        owners = {index: body for index, (body, _) in self._colliders.items()}
        radii = [body_extent(body, scene.extents).radius for body in scene.bodies]
        self._slip = SlipReader(world, self._bodies, radii, owners)
        self._weighed: list[tuple[Any, float]] = []
        self._read = [self._bodies[i] for i in scene.moving]
        anchor = world.add_body(self._rapier.RigidBody.fixed().translation(tuple(-self._center)))
        for joint in scene.joints:
            ends = (self._handles[i] if i >= 0 else anchor for i in joint.bodies)
            world.impulse_joints.insert(*ends, build_joint(joint), True)
        if self._friction.are_needed:
            world.physics_hooks = self._friction

    def step(self) -> None:
        """Advance the world by a step."""
        self._friction.begin_step(self._slip)
        self._world.step()

    def move(self, index: int, position: Floats, rotation: Floats) -> None:
        """Move an animated body to a frame by the end of the next step."""
        self._bodies[index].set_next_kinematic_position(
            isometry(Frame(self._units * position - self._center, rotation))
        )

    def states(self) -> Floats:
        """Return position and quaternion xyzw (M, 7) of the moving bodies, relative to `center`."""
        states = [(*body.translation.to_tuple(), *body.rotation.to_tuple()) for body in self._read]
        found = np.array(states, np.float64).reshape(-1, 7)
        if self._units != 1.0:
            found[:, :3] /= self._units
        return found

    @property
    def center(self) -> Floats:
        """Origin (3,) m of the states, near the bodies: float32 is finest there."""
        return self._center / self._units

    def energy(self) -> tuple[float, float]:
        """Return kinetic and potential energy of the dynamic bodies, in joules; after the first step."""
        if not self._weighed:  # once: masses don't change, and Rapier has them from the first step on
            self._weighed = [(body, body.mass * factor) for body, factor in self._finite()]
        x, y, z = self._scene.gravity
        kinetic = potential = 0.0
        for body, mass in self._weighed:
            kinetic += body.kinetic_energy()
            px, py, pz = body.center_of_mass.to_tuple()
            potential -= mass * (x * px + y * py + z * pz)
        return kinetic / self._units**2, potential / self._units**2

    def _finite(self) -> list[tuple[Any, float]]:
        """Dynamic bodies of finite mass, with their gravity factor."""
        scene = self._scene
        found = [i for i in scene.moving if scene.bodies[i].kind is BodyKind.DYNAMIC]
        motions = [(i, scene.bodies[i].motion) for i in found]
        return [(self._bodies[i], motion.gravity_factor) for i, motion in motions if motion.mass != math.inf]

    def mass(self) -> float:
        """Return the mass of the dynamic bodies in kg, without infinite ones."""
        return sum(float(body.mass) for body in self._read if body.is_dynamic and body.mass < INFINITE_MASS_KG)

    def contacts(self) -> list[tuple[int, int, float]]:
        """Return the pairs of bodies in contact with their deepest penetration in metres."""
        found = []
        for pair in self._world.narrow_phase.contact_pairs():
            depths = [-point.dist for manifold in pair.manifolds for point in manifold.points]
            if depths:
                ends = (self._colliders[handle.index][0] for handle in (pair.collider1, pair.collider2))
                first, second = sorted(ends)
                found.append((first, second, max(depths) / self._units))
        return found

    def centers_of_mass(self) -> Floats:
        """Return the centers of mass (M, 3) of the moving bodies in their own frames; after the first step."""
        centers = [body.local_center_of_mass.to_tuple() for body in self._read]
        return np.array(centers).reshape(-1, 3) / self._units

    def pushing_contacts(self, index: int) -> list[tuple[int, float, Floats, Floats]]:
        """Return the contacts that pushed a body in the last step, the strongest of each pair of colliders.

        Each: the other body, the distance of the shapes at the start of the step, the normal (3,) from the other, and
        the point (3,). Of shapes of several parts, whose contacts Rapier joins and gives no impulses, the nearest.
        Rapier's impulses are those of its last substep. A body that bounced in an earlier one has none there: then
        all contacts are returned that may have pushed it.
        """
        touching = [
            (handle, pair)
            for handle in self._bodies[index].colliders
            for pair in self._world.narrow_phase.contact_pairs_with(handle)
            if pair.has_any_active_contact
        ]
        pushing = [(handle, pair) for handle, pair in touching if pair.total_impulse_magnitude()]
        found = (self._strongest_contact(index, handle, pair) for handle, pair in pushing or touching)
        return [each for each in found if each is not None]

    def _strongest_contact(self, index: int, handle: Any, pair: Any) -> tuple[int, float, Floats, Floats] | None:
        is_second = self._colliders[pair.collider2.index][0] == index
        other = self._colliders[(pair.collider1 if is_second else pair.collider2).index][0]
        contacts = [(point, manifold) for manifold in pair.manifolds for point in manifold.points]
        if not contacts:
            return None
        point, manifold = max(contacts, key=lambda each: (each[0].impulse, -each[0].dist))
        normal = (1.0 if is_second else -1.0) * np.array(manifold.data.normal.to_tuple())
        at = self._contact_point(handle, manifold, is_second)
        return other, float(point.dist) / self._units, normal, at / self._units

    def _contact_point(self, handle: Any, manifold: Any, is_second: bool) -> Floats:
        """World position of a manifold's contacts, in the middle; handle: of the collider that is the second or not."""
        sets, data = self._world.rigid_bodies, manifold.data
        points = [data.solver_contact_world_points(each, sets)[0] for each in data.solver_contacts]
        if not points:
            own = self._world.colliders[handle].position
            points = [own.transform_point(each.local_p2 if is_second else each.local_p1) for each in manifold.points]
        return np.asarray(np.mean([each.to_tuple() for each in points], axis=0))

    def has_failed(self) -> bool:
        """Return whether Rapier took a body out in this step, whose state was no longer finite."""
        return bool(len(self._world.quarantine.bodies))

    def _add_body(self, index: int, body: RigidBody) -> Any:
        rapier, kind = self._rapier, body.kind
        makers = {
            BodyKind.DYNAMIC: rapier.RigidBody.dynamic,
            BodyKind.STATIC: rapier.RigidBody.fixed,
            BodyKind.KINEMATIC: rapier.RigidBody.kinematic_velocity_based,
            BodyKind.ANIMATED: rapier.RigidBody.kinematic_position_based,
        }
        frame = Frame(body.frame.position - self._center, body.frame.rotation)
        builder = makers[kind]().position(isometry(frame)).ccd_enabled(kind is BodyKind.DYNAMIC)
        if kind in (BodyKind.DYNAMIC, BodyKind.KINEMATIC):
            factor = body.motion.gravity_factor if kind is BodyKind.DYNAMIC else 0.0
            builder = builder.linvel(tuple(body.linear_velocity + factor * self._early)).gravity_scale(factor)
            builder = builder.angvel(tuple(body.angular_velocity))
        shapes = [self._shapes.build(each, body) for each in body.colliders]
        if kind is BodyKind.DYNAMIC:
            builder = builder.additional_mass_properties(self._shapes.mass(body, shapes))
        handle = self._world.add_body(builder)
        for each, shape in zip(body.colliders, shapes, strict=True):
            added = self._world.add_collider(self._collider(each, shape), handle)
            self._colliders[added.index] = (index, each)
            self._friction.add(added.index, index, each.material, self._world.colliders[added])
        return handle

    def _collider(self, collider: BodyCollider, shape: Any) -> Any:
        builder = self._rapier.Collider.new(shape).position(isometry(shape_frame(collider))).density(0.0)
        return builder.collision_groups(self._groups[collider.filter])


def _allowed_penetration(scene: RigidScene) -> float:
    least = MAX_PENETRATION_PER_RADIUS * smallest_radius(scene, 1.0)
    return float(np.clip(least, MIN_PENETRATION_M, MAX_PENETRATION_M))
