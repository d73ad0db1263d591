"""A bound mesh instance in a bake: its matrices, and its columns in the output."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.errors import AnimError, RangeError
from anim.maths import matrix
from anim.model import MeshInstance, Skeleton
from anim.sampling.pose import PosedSkeleton
from anim.skinning.binding import SkinBinding, bind_skin
from anim.skinning.kernels.layout import NO_OUTPUT, FloatArray, OutputSlice, VertexBlock
from anim.skinning.methods.skinner import Skinner, fill_lanes
from anim.skinning.vertex_normals import SmoothNormals

MAX_BLOCK_MATRICES = 100_000  # of joints, multiplied at a time: 10 MB of each operand

Make: TypeAlias = Callable[[SkinBinding, bool], Skinner]


@dataclass(frozen=True, slots=True)
class BoundMesh:
    """An instance, its rig and skinner, and its first column.

    in_mesh_space: whether positions are in the space of the instance's node. smooth: source of normals from faces
    if the mesh has none. static_block: its vertices without morph targets.
    """

    instance: MeshInstance
    rig: SkinBinding
    skinner: Skinner
    at: int
    in_mesh_space: bool
    smooth: SmoothNormals | None
    static_block: VertexBlock

    @property
    def packed_size(self) -> int:
        """Approximate bytes of a packed frame: its matrices, and vertices if they are morphed."""
        morphed = len(self.rig.points) if len(self.instance.mesh.targets) else 0
        return 96 * len(self.rig.nodes) + 36 * morphed

    def pack(self, frames: PosedSkeleton, block: slice) -> tuple[Any, VertexBlock]:
        """Return the input of `skin` for some of the frames."""
        return self.skinner.pack(self.matrices(frames, block)), self._shape(frames, block)

    def skin(self, packed: tuple[Any, VertexBlock], block: slice, whole: OutputSlice, first: int, last: int) -> None:
        """Write vertices first … last, for a block of frames, into the output."""
        parts, shape = packed
        normals = whole.normals[block] if len(shape.normals) else NO_OUTPUT
        tangents = whole.tangents[block] if len(shape.tangents) else NO_OUTPUT
        self.skinner.skin(parts, shape, OutputSlice(self.at, whole.positions[block], normals, tangents), first, last)

    def finish(self, frames: PosedSkeleton, whole: OutputSlice) -> None:
        """Transform positions from world to mesh space, and compute normals from faces, if requested."""
        span = slice(self.at, self.at + len(self.rig.points))
        if self.in_mesh_space and self.instance.skin is not None:
            node = frames.world[self.instance.node]
            back = _inverse(node)
            whole.positions[:, span] = matrix.apply(back, whole.positions[:, span].astype(np.float64))
            if len(self.rig.normals):  # the inverse transpose of the inverse, for row vectors
                whole.normals[:, span] = _unit(whole.normals[:, span] @ node[..., :3])
            if len(self.rig.tangents):
                whole.tangents[:, span] = _unit(whole.tangents[:, span] @ np.swapaxes(back[..., :3], -1, -2))
        if self.smooth is not None:
            self.smooth.of(whole.positions[:, span], whole.normals[:, span])

    def at_rest(self, frames: PosedSkeleton) -> Floats:
        """Return the vertices (V, 3) in the first of the frames, blended linearly in float64."""
        bound = self.matrices(frames, slice(0, 1))[0]
        points = _morph(self.rig.points, self.instance.mesh.targets, self._weights(frames, slice(0, 1)))[..., 0]
        owner = np.repeat(np.arange(len(points)), np.diff(self.rig.start))
        chosen = bound[self.rig.joint]
        moved = np.einsum("eij,ej->ei", chosen[..., :3], points[owner]) + chosen[..., 3]
        weighted = moved * self.rig.weight[:, None]
        sums = [np.bincount(owner, part, minlength=len(points)) for part in weighted.T]
        placed: Floats = np.stack(sums, axis=-1).astype(np.float64)
        if self.in_mesh_space and self.instance.skin is not None:
            placed = matrix.apply(_inverse(frames.world[self.instance.node, :1])[0], placed)
        return placed

    def matrices(self, frames: PosedSkeleton, block: slice) -> Floats:
        """Return world_from_mesh (n, J, 3, 4) of the joints; without a skin, of the node."""
        if self.in_mesh_space and self.instance.skin is None:
            count = len(frames.times[block])
            return np.broadcast_to(np.eye(4)[:3], (count, 1, 3, 4))
        nodes, count = self.rig.nodes, len(frames.times[block])
        product = np.empty((len(nodes), 3 * count, 4))  # one per joint, not per frame: ten times faster
        length = max(MAX_BLOCK_MATRICES // max(count, 1), 1)
        for first in range(0, len(nodes), length):
            some = slice(first, first + length)
            world, bind = frames.world[nodes[some], block], self.rig.bind[some]
            whole = np.zeros((len(bind), 4, 4))
            whole[:, :3], whole[:, 3, 3] = bind, 1
            np.matmul(world.reshape(len(bind), 3 * count, 4), whole, out=product[some])
        return product.reshape(len(nodes), count, 3, 4).transpose(1, 0, 2, 3)

    def _shape(self, frames: PosedSkeleton, block: slice) -> VertexBlock:
        mesh, weights = self.instance.mesh, self._weights(frames, block)
        if not weights.any():
            return self.static_block
        points = _morph(self.rig.points, mesh.targets, weights)
        normals = _morph(self.rig.normals, mesh.normal_targets, weights)
        tangents = _morph(self.rig.tangents, mesh.tangent_targets, weights)
        return VertexBlock(_rows(points), _rows(normals), _rows(tangents))

    def _weights(self, frames: PosedSkeleton, block: slice) -> Floats:
        """Morph weights (n, M), or (1, M) if they are not animated."""
        animated = frames.weights.get(self.instance.node)
        return self.instance.weights[None] if animated is None else animated[block]


def bind_mesh(
    skeleton: Skeleton,
    instance: MeshInstance,
    make: Make,
    at: int,
    *,
    space: str,
    normals: bool,
    tangents: bool,
) -> BoundMesh:
    """Return the layer of an instance. at: its first column.

    make: called with its rig, and whether its points are constant and need no directions.
    """
    name = instance.mesh.name or skeleton.display_name(instance.node)
    try:
        bound = bind_skin(instance, skeleton.parents, normals=normals, tangents=tangents)
    except AnimError as error:
        raise error.at(f"mesh '{name}'") from None
    smooth = SmoothNormals(bound.faces, len(bound.points)) if normals and instance.mesh.normals is None else None
    plain = not len(instance.mesh.targets) and not len(bound.normals) and not len(bound.tangents)
    static_block = VertexBlock(*(_rows(part[:, :, None]) for part in (bound.points, bound.normals, bound.tangents)))
    return BoundMesh(instance, bound, make(bound, plain), at, space == "mesh", smooth, static_block)


def _morph(base: Floats, targets: Floats | None, weights: Floats) -> Floats:
    """base (V, 3) and targets (M, V, 3) by weights (n, M) → (V, 3, n); skips targets of weight 0."""
    if targets is None or not len(targets) or not len(base):
        return base[:, :, None]
    used = np.flatnonzero(weights.any(axis=0))
    if not len(used):
        return base[:, :, None]
    moved = targets[used].reshape(len(used), -1).T @ weights[:, used].T
    return np.asarray(base[:, :, None] + moved.reshape(*base.shape, -1))


def _rows(values: Floats) -> FloatArray:
    return np.ascontiguousarray(values, np.float32) if values.shape[2] == 1 else fill_lanes(values)


def _unit(vectors: Floats) -> Floats:
    length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    return np.asarray(vectors / np.where(length > 0, length, 1))


def _inverse(world: Floats) -> Floats:
    """Inverses (F, 3, 4) of a node's matrices. Raises RangeError if one is singular."""
    linear = world[..., :3]
    if not (np.abs(np.linalg.det(linear)) > 0).all():
        raise RangeError("mesh space is flat: the node of a mesh has scale 0 (expected space 'world')")
    back = np.linalg.inv(linear)
    return np.concatenate((back, -(back @ world[..., 3:])), axis=-1)
