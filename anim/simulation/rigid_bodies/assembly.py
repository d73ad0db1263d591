"""Description of bodies + pose at the start → RigidScene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.errors import AnimError, FormatError, RangeError
from anim.maths import hierarchy, matrix, quaternion
from anim.model import Clip, Skeleton
from anim.model.skeleton import nearest_at_or_above, node_mask
from anim.simulation.rigid_bodies.description import Collider, Motion, PhysicsDescription, Shape, Vector
from anim.simulation.rigid_bodies.extension_values import as_fault
from anim.simulation.rigid_bodies.rigid_scene import (
    WORLD,
    BodyCollider,
    BodyKind,
    Frame,
    RigidBody,
    RigidJoint,
    RigidScene,
)
from anim.simulation.rigid_bodies.shape_extents import ShapeExtents
from anim.simulation.rigid_bodies.shapes import ScaledShapes

REST = Motion()
ZERO: Floats = np.zeros(3)
IDENTITY: Floats = np.array([0.0, 0.0, 0.0, 1.0])


def assemble(
    description: PhysicsDescription, skeleton: Skeleton, clip: Clip, world: Floats, gravity: Vector
) -> RigidScene:
    """Return the bodies of a description at the start.

    A node with a motion owns the colliders below it, down to the next such node. A collider without one is static, or
    animated if the clip moves its node or a parent. A motion whose own node the clip moves follows the clip.
    world: world_from_node (N, 3, 4) at the start. Raises RangeError without a body, or if the clip moves all of them.
    """
    if not description.motions:
        raise RangeError("there is no body to simulate", help="name some with `body`")
    tracked = {track.node for track in clip.tracks if track.path in ("translation", "rotation", "scale")}
    is_tracked = hierarchy.with_descendants(skeleton.parents, node_mask(skeleton, tracked))
    owned = _colliders_by_owner(description, skeleton)
    positions, rotations, _, _ = matrix.decompose(world)
    frames = [Frame(*each) for each in zip(positions, rotations, strict=True)]
    bodies, assembly = [], _Assembly(description, skeleton, world, frames)
    for node, motion in description.motions.items():
        own = owned.get(node, [])
        kind = BodyKind.KINEMATIC if motion.kinematic else BodyKind.DYNAMIC
        kind = BodyKind.ANIMATED if node in tracked and motion.follows_clip else kind
        bodies.append(assembly.build_body(node, kind, motion, own))
    if all(body.kind is BodyKind.ANIMATED for body in bodies):
        raise RangeError(
            "the clip moves every body: there is none to simulate",
            help="name others with `body`, or with `clip` one that does not move them",
        )
    for node in owned.get(-1, []):
        kind = BodyKind.ANIMATED if is_tracked[node] else BodyKind.STATIC
        bodies.append(assembly.build_body(node, kind, REST, [node]))
    indices = {body.node: i for i, body in enumerate(bodies)}
    joints = tuple(_joints(description, skeleton, indices, frames))
    if description.floor is not None:
        bodies.append(_floor(description))
    return RigidScene(tuple(bodies), joints, gravity, assembly.extents)


def _colliders_by_owner(description: PhysicsDescription, skeleton: Skeleton) -> dict[int, list[int]]:
    """Nodes with a collider by the nearest node with a motion, from their own upwards; −1 for none."""
    owners = nearest_at_or_above(skeleton.parents, node_mask(skeleton, description.motions)).tolist()
    found: dict[int, list[int]] = {}
    for node in description.colliders:
        found.setdefault(owners[node], []).append(node)
    return found


def ancestors(skeleton: Skeleton, node: int) -> list[int]:
    """Return a node and its ancestors, upwards."""
    found = []
    while node >= 0:
        found.append(node)
        node = int(skeleton.parents[node])
    return found


def relative_frame(outer: Frame, inner: Frame) -> Frame:
    """Return `inner` in the space of `outer`."""
    back = quaternion.conjugate(outer.rotation)
    return Frame(quaternion.rotate(back, inner.position - outer.position), quaternion.multiply(back, inner.rotation))


class _Assembly:
    """Parts of bodies, whose shapes and extents are shared by all. frames, world: of nodes at the start."""

    def __init__(
        self, description: PhysicsDescription, skeleton: Skeleton, world: Floats, frames: Sequence[Frame]
    ) -> None:
        self.extents = ShapeExtents()
        self._shapes = ScaledShapes()
        self._description, self._skeleton = description, skeleton
        self._world, self._frames = world, frames

    def build_body(self, node: int, kind: BodyKind, motion: Motion, colliders: Sequence[int]) -> RigidBody:
        """Return the body of a node. colliders: nodes of those that it owns."""
        made, frame = [], self._frames[node]
        for each in colliders:
            try:
                made += self._collider(each, frame)
            except AnimError as error:
                raise as_fault(error, self._skeleton.label(each)) from None
        reach = [float(np.linalg.norm(each.frame.position)) + self.extents.of(each.shape).reach for each in made]
        spin = quaternion.rotate(frame.rotation, np.array(motion.angular_velocity))
        velocity: Floats = np.array(motion.linear_velocity)
        velocity = velocity if motion.velocity_in_world else quaternion.rotate(frame.rotation, velocity)
        return RigidBody(node, kind, frame, tuple(made), motion, velocity, spin, max(reach, default=0.0))

    def _collider(self, node: int, body: Frame) -> list[BodyCollider]:
        """One collider in its body's frame; none for a scale of 0, which disables it."""
        collider, own = self._description.colliders[node], self._frames[node]
        linear = quaternion.to_matrix(quaternion.conjugate(own.rotation)) @ self._world[node][:, :3]
        if not np.linalg.norm(linear, axis=0).any():
            return []
        shape = self._shapes.scale(collider.shape, linear)
        return [BodyCollider(node, shape, relative_frame(body, own), collider.material, collider.filter)]


def _joints(
    description: PhysicsDescription, skeleton: Skeleton, indices: dict[int, int], frames: Sequence[Frame]
) -> list[RigidJoint]:
    found = []
    carriers = _carriers(skeleton, description, indices) if description.joints else []
    for joint in description.joints:
        ends = (joint.node, joint.connected)
        owners = [carriers[node] for node in ends]
        if max(owners) < 0:
            raise FormatError("a joint connects no body", where=skeleton.label(joint.node))
        if owners[0] == owners[1]:
            raise FormatError("a joint connects a body with itself", where=skeleton.label(joint.node))
        own = [frames[owner] if owner >= 0 else Frame(ZERO, IDENTITY) for owner in owners]
        local = [relative_frame(outer, frames[node]) for outer, node in zip(own, ends, strict=True)]
        bodies = [indices[owner] if owner >= 0 else WORLD for owner in owners]
        found.append(
            RigidJoint((bodies[0], bodies[1]), (local[0], local[1]), joint.limits, joint.drives, joint.enable_collision)
        )
    return found


def _carriers(skeleton: Skeleton, description: PhysicsDescription, indices: dict[int, int]) -> list[int]:
    """For every node the body that carries a joint's frame there: with a motion, or an animated collider; −1 for none.

    indices: of the bodies, by node.
    """
    moved, held = (
        nearest_at_or_above(skeleton.parents, node_mask(skeleton, nodes)) for nodes in (description.motions, indices)
    )
    found: list[int] = np.where(moved >= 0, moved, held).tolist()
    return found


def _floor(description: PhysicsDescription) -> RigidBody:
    assert description.floor is not None
    plane = Collider(Shape("plane"), description.floor_material)
    frame = Frame(np.array([0.0, description.floor, 0.0]), IDENTITY)
    own = BodyCollider(-1, plane.shape, Frame(ZERO, IDENTITY), plane.material, plane.filter)
    return RigidBody(-1, BodyKind.STATIC, frame, (own,), REST, ZERO, ZERO, 0.0)
