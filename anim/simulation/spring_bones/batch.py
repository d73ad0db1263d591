"""One batch: joints of one level that are advanced side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix, quaternion
from anim.model import Skeleton
from anim.simulation.spring_bones.angle_limits import AngleLimits
from anim.simulation.spring_bones.chains import SpringJoint
from anim.simulation.spring_bones.colliders import Collider
from anim.simulation.spring_bones.collisions import TINY, Collisions, cofactors, norms
from anim.simulation.spring_bones.driver import DriverChunk
from anim.simulation.spring_bones.hierarchy import tail_at_rest
from anim.simulation.spring_bones.plan import Plan, PlannedJoint
from anim.simulation.spring_bones.spring_models import MassSpringModel, make_model

ROUNDING = 1e-12  # of a length, between two ways to compute it
OPPOSITE = float(np.finfo(np.float64).eps)  # 1 + cosine below which two directions are opposite, as in players
# Elements of a rotation matrix, row by row, from the products of a quaternion's components (x, y, z, w) ⊗ (x, y, z, w).
_PRODUCTS = np.zeros((4, 4, 3, 3))
for _i in range(3):
    _j, _k = (_i + 1) % 3, (_i + 2) % 3
    _PRODUCTS[_i, _i, _i, _i] = _PRODUCTS[3, 3, _i, _i] = 1
    _PRODUCTS[_j, _j, _i, _i] = _PRODUCTS[_k, _k, _i, _i] = -1
    _PRODUCTS[_i, _j, _i, _j] = _PRODUCTS[_i, _j, _j, _i] = 2
    _PRODUCTS[_k, 3, _j, _i] = 2
    _PRODUCTS[_k, 3, _i, _j] = -2


class Batch:
    """m joints of one level and one model.

    indices: (m,) of the joints among all of the simulation. tails: (m, 3) in world space, after the last step.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        planned: Sequence[PlannedJoint],
        colliders: Sequence[Collider],
        plan: Plan,
        step: float,
        integrator: str = "",
    ) -> None:
        self._skeleton = skeleton
        self._joints = [each.joint for each in planned]
        nodes = np.array([joint.node for joint in self._joints])
        self.indices = np.array([each.index for each in planned])
        self._nodes = nodes
        self._rows = slice(int(plan.rows[nodes[0]]), int(plan.rows[nodes[-1]]) + 1)
        self._parents = _as_slice(plan.rows[skeleton.parents[nodes]])
        self._centers = _center_rows(planned, plan)
        self._own = np.array([i for i, each in enumerate(planned) if each.chain.center == each.joint.node], np.int64)
        parameters = [joint.parameters for joint in self._joints]
        self._model = make_model(parameters, step, integrator)
        chosen = [each.chain.colliders for each in planned]
        hit_radius = np.array([each.hit_radius for each in parameters])
        collider_rows = plan.rows[np.array([-1 if each.node is None else each.node for each in colliders], np.int64)]
        self._collisions = Collisions(colliders, chosen, hit_radius, collider_rows) if any(chosen) else None
        self._rest = skeleton.rotation[nodes]
        self._rotation: Floats = self._rest.copy()
        self._axis = np.array([_unit(tail_at_rest(skeleton, joint)) for joint in self._joints])
        limits = [joint.limit for joint in self._joints]
        self._limits = AngleLimits(limits, self._axis) if any(limits) else None
        self._from_direction, self._opposite = _rotation_maps(self._rest, self._axis)

    def load(self, chunk: DriverChunk) -> None:
        """Take the driver's values at the steps of a chunk; what is constant over it is kept once.

        Columns: the joints' matrices at rest, the axis with the tail's length, and the tail if an animated translation
        takes it off the axis: the axis is that of the rest pose, the length that of the current one.
        """
        pose = chunk.pose
        scale = pose.scale[:, self._nodes]
        tail = np.stack([_tails(chunk, self._skeleton, joint) for joint in self._joints], axis=1)
        local = np.swapaxes(chunk.local[self._nodes], 0, 1)
        along = self._axis * norms(tail)
        points = [along] if np.abs(tail - along).max() <= ROUNDING * np.abs(tail).max() else [along, tail]
        self._columns = _constant(np.concatenate((local, local[..., :3] @ np.stack(points, axis=-1)), axis=-1))
        self._scale = _constant(scale[:, :, None, :])
        self._has_scale = bool((scale != 1).any())

    def start(self, world: Floats) -> None:
        """Set the joints to rest at the first step of the chunk, and their world matrices."""
        self._rotation = self._rest.copy()
        parents, columns = world[self._parents], self._columns[0]
        world[self._rows] = matrix.multiply(parents, columns[..., :4])
        head = world[self._rows, :, 3]
        goal = head + _bones(np.matmul(parents[..., :3], columns))[0]
        self._model.start(head, goal, self._center(world))
        self.tails = goal

    def advance(self, world: Floats, frame: int) -> Floats:
        """Advance by one step, update the world matrices, and return the local rotations (m, 4)."""
        parents = world[self._parents]
        linear = parents[:, :, :3]
        columns = np.matmul(linear, _at(self._columns, frame))
        head = columns[..., 3] + parents[..., 3]
        bone, length = _bones(columns)
        if len(self._own):
            self._place_own_centers(world, linear, head, frame)
        center = self._center(world)
        tail = self._model.predict(head, head + bone, center)
        offset = tail - head
        tail = free = head + offset * (length / np.maximum(norms(offset), TINY))
        limits, rest = self._limits, columns[..., :3]
        limit = None if limits is None else lambda points: limits.resolve(rest, head, length, points)
        tail = tail if limit is None else limit(tail)
        if self._collisions is not None:
            tail = self._collisions.resolve(world, head, length, tail, limit)
        self._model.accept(head, free, tail, center)
        self.tails = tail
        self._rotation = self._rotations(columns, tail - head)
        self._place(world, linear, head, frame)
        return np.asarray(self._rotation)

    def figures(self) -> tuple[Floats, Floats] | None:
        """Return elongation and energy (m,) after the last step; None for models that keep lengths."""
        return (self._model.elongation, self._model.energy) if isinstance(self._model, MassSpringModel) else None

    def transform(self, world: Floats, before: Floats | None, after: Floats | None) -> None:
        """Move the state by matrices (m, 3, 4), as the driver jumps."""
        self._model.transform(world, before, after)

    def _center(self, world: Floats) -> Floats | None:
        return None if self._centers is None else world[self._centers]

    def _rotations(self, columns: Floats, offset: Floats) -> Floats:
        """Local rotations (m, 4) that point the joints' axes along `offset` (m, 3) in world space.

        columns: (m, 3, 5) with the joints' world matrices at rest. The direction in the joint's space is that of the
        inverse times the offset; the transposed cofactors are the inverse up to a factor.
        """
        cofactor = cofactors(columns)
        local = np.matmul(offset[:, None, :], cofactor)[:, 0]
        mirrored = (columns[:, 0, :3] * cofactor[:, 0]).sum(axis=-1) < 0
        if mirrored.any():
            local[mirrored] *= -1
        direction = local / np.maximum(norms(local), TINY)
        rotation = np.matmul(self._from_direction, direction[..., None])[..., 0] + self._rest
        square = np.einsum("ij,ij->i", rotation, rotation)[:, None]
        if square.min() < 2 * OPPOSITE:
            rotation = np.where(square < 2 * OPPOSITE, self._opposite, rotation)
            square = np.where(square < 2 * OPPOSITE, 1.0, square)
        return np.asarray(rotation / np.sqrt(square))

    def _place(self, world: Floats, linear: Floats, head: Floats, frame: int) -> None:
        rotation = self._rotation
        products = (rotation[:, :, None] * rotation[:, None, :]).reshape(-1, 16)
        local = (products @ _PRODUCTS.reshape(16, 9)).reshape(-1, 3, 3)
        if self._has_scale:
            local = local * _at(self._scale, frame)
        np.matmul(linear, local, out=world[self._rows, :, :3])
        world[self._rows, :, 3] = head

    def _place_own_centers(self, world: Floats, linear: Floats, head: Floats, frame: int) -> None:
        """World matrices of joints that are the center of their own chain, with their rotation before this step."""
        self._place(world, linear, head, frame)


def _bones(columns: Floats) -> tuple[Floats, Floats]:
    """Vectors (m, 3) from the joints along their axes to the distance of the tails, and these lengths (m, 1)."""
    bone, length = columns[..., 4], norms(columns[..., -1])
    return (bone, length) if columns.shape[-1] == 5 else (bone * (length / np.maximum(norms(bone), TINY)), length)


def _tails(chunk: DriverChunk, skeleton: Skeleton, joint: SpringJoint) -> Floats:
    """The tail (F, 3) of a joint in its own space over a chunk, with the driver's translation and scale."""
    if joint.tail is None:
        return np.tile(joint.tail_offset, (chunk.local.shape[1], 1))
    points = chunk.pose.translation[:, joint.tail]
    node = int(skeleton.parents[joint.tail])
    while node != joint.node:
        points = matrix.apply(chunk.local[node], points[:, None])[:, 0]
        node = int(skeleton.parents[node])
    return points


def _rotation_maps(rest: Floats, axis: Floats) -> tuple[Floats, Floats]:
    """Linear maps (m, 4, 3) from a direction d to rest ⊗ (axis × d, axis · d), and the half turns (m, 4).

    rest + the mapped direction is the local rotation from the axis to d, not normalized. A half turn is the rotation to
    the opposite of the axis, about the same perpendicular axis as in three.js.
    """
    size = len(axis)
    arc = np.zeros((size, 4, 3))
    arc[:, :3] = np.cross(axis[:, None, :], np.eye(3)[None]).transpose(0, 2, 1)
    arc[:, 3] = axis
    maps = np.stack([quaternion.multiply(rest, arc[..., i]) for i in range(3)], axis=-1)
    x, y, z = axis.T
    none = np.zeros(size)
    about = np.where((np.abs(x) > np.abs(z))[:, None], np.stack((-y, x, none), -1), np.stack((none, -z, y), -1))
    half_turn = np.concatenate((about / np.maximum(norms(about), TINY), none[:, None]), axis=-1)
    return maps, quaternion.multiply(rest, half_turn)


def _center_rows(planned: Sequence[PlannedJoint], plan: Plan) -> Ints | None:
    centers = [each.chain.center for each in planned]
    return None if centers[0] is None else plan.rows[[-1 if each is None else each for each in centers]]


def _as_slice(rows: Ints) -> Ints | slice:
    """Consecutive rows as a slice, which numpy reads without a copy."""
    consecutive = (np.diff(rows) == 1).all()
    return slice(int(rows[0]), int(rows[-1]) + 1) if consecutive else rows


def _constant(values: Floats) -> Floats:
    """Values (F, …), or only the first of them (1, …) if all are equal."""
    return values[:1] if (values == values[:1]).all() else values


def _at(values: Floats, frame: int) -> Floats:
    return np.asarray(values[frame if len(values) > 1 else 0])


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
