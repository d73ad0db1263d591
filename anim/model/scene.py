"""Skin, Mesh, MeshInstance and Scene: vertices and their binding to a skeleton."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from anim import arrays
from anim.arrays import Floats, Ints
from anim.errors import FormatError, ShapeError
from anim.model.skeleton import Skeleton

WEIGHT_SUM_TOLERANCE = 1e-3  # error of a vertex's sum of skin weights from 1, above rounding


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """Joints of a skin, and the matrices from mesh space to each joint's space in bind pose.

    joints: (J,) node indices. inverse_bind: (J, 3, 4).
    """

    joints: Ints
    inverse_bind: Floats

    def __post_init__(self) -> None:
        if len(self.joints) != len(self.inverse_bind):
            raise ShapeError(f"{len(self.inverse_bind)} inverse bind matrices for {len(self.joints)} joints")

    def __repr__(self) -> str:
        return f"Skin(joints={len(self.joints)})"


class PrimitiveRange(NamedTuple):
    """Numbers of vertices and faces of one primitive. material: its index in the file, −1 for none."""

    vertices: int
    faces: int
    material: int = -1


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Vertices of all primitives of a glTF mesh, one after another.

    positions: (V, 3) m. faces: (T, 3). joints, weights: (V, I), I = 0 without a skin; weights ≥ 0 with sum 1 per
    vertex.
    targets: (M, V, 3) morph displacements. rest_weights: (M,) of the mesh. normals: (V, 3), or None if any
    is missing or they were not read.
    tangents: (V, 4) xyz and handedness ±1, like normals. normal_targets, tangent_targets: (M, V, 3) displacements
    of normals and tangents by morph targets, or None.
    primitives: in the order of the file; empty if unknown. weight_sums: (V,) sums of the weights in the file, if any
    deviates from 1 by more than rounding.
    repeats: of the last of the primitives, which have the vertices and faces of earlier ones and don't store them
    again, the indices of those.
    """

    name: str
    positions: Floats
    faces: Ints
    joints: Ints
    weights: Floats
    targets: Floats
    rest_weights: Floats
    normals: Floats | None = None
    normal_targets: Floats | None = None
    primitives: tuple[PrimitiveRange, ...] = ()
    tangents: Floats | None = None
    tangent_targets: Floats | None = None
    weight_sums: Floats | None = None
    repeats: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        arrays.check_shape(self.positions, "V 3", name="positions")
        where = f"mesh '{self.name}'" if self.name else ""
        if len(self.weights) and self.weights.size and self.weights.min() < 0:
            raise FormatError(f"a skin weight is negative ({self.weights.min():g})", where=where)
        if self.weights.size and (off := np.abs(self.weights.sum(axis=1) - 1)).max() > WEIGHT_SUM_TOLERANCE:
            v = int(off.argmax())
            raise ShapeError(f"skin weights of vertex {v} add up to {self.weights[v].sum():g} (expected 1)")
        if self.faces.size and int(self.faces.max()) >= len(self.positions):
            raise FormatError(f"a face uses vertex {self.faces.max()} (of {len(self.positions)})", where=where)

    @property
    def stored_primitives(self) -> tuple[PrimitiveRange, ...]:
        """The primitives whose vertices and faces are stored, one after another."""
        return self.primitives[: len(self.primitives) - len(self.repeats)]

    @property
    def vertex_count(self) -> int:
        """Number of vertices in the file, with those of repeated primitives."""
        return len(self.positions) + sum(self.primitives[i].vertices for i in self.repeats)

    def count_uses(self) -> Ints:
        """Return the number of primitives (V,) that have each vertex."""
        if not self.repeats:
            return np.ones(len(self.positions), np.int64)
        stored = self.stored_primitives
        uses = 1 + np.bincount(self.repeats, minlength=len(stored))
        return np.repeat(uses, [each.vertices for each in stored])

    def store_repeats(self) -> Mesh:
        """Return the mesh with the vertices and faces of repeated primitives stored again, without directions."""
        if not self.repeats:
            return self
        stored = self.stored_primitives
        firsts = np.cumsum([0, *(each.vertices for each in stored)])
        faces = np.split(self.faces, np.cumsum([each.faces for each in stored])[:-1])
        added = np.cumsum([len(self.positions), *(stored[i].vertices for i in self.repeats)])
        shifted = [faces[i] + (first - firsts[i]) for i, first in zip(self.repeats, added.tolist(), strict=False)]
        kept = np.concatenate([np.arange(len(self.positions)), *(np.arange(*firsts[i : i + 2]) for i in self.repeats)])
        return replace(
            self.keep_vertices(kept),
            faces=np.concatenate([self.faces, *shifted]),
            primitives=self.primitives,
            weight_sums=None if self.weight_sums is None else self.weight_sums[kept],
        )

    def keep_vertices(self, kept: Ints) -> Mesh:
        """Return a mesh of some vertices (N,), with skin and morph targets, and without faces and directions."""
        return Mesh(
            self.name,
            self.positions[kept],
            np.empty((0, 3), np.int64),
            self.joints[kept],
            self.weights[kept],
            self.targets[:, kept],
            self.rest_weights,
        )

    def __repr__(self) -> str:
        counts = f"vertices={len(self.positions)}, faces={len(self.faces)}, targets={len(self.targets)}"
        return f"Mesh({self.name!r}, {counts})"


@dataclass(frozen=True, slots=True, eq=False)
class MeshInstance:
    """Mesh on a node; with a skin the vertices follow the joints only, and the node is ignored.

    weights: (M,) morph weights at rest: the node's own, or the mesh's.
    """

    node: int
    mesh: Mesh
    skin: Skin | None
    weights: Floats

    def __repr__(self) -> str:
        return f"MeshInstance(node={self.node}, {self.mesh!r}, {self.skin!r})"


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Skeleton and mesh instances, in depth-first order of nodes."""

    skeleton: Skeleton
    instances: tuple[MeshInstance, ...]

    @property
    def vertex_count(self) -> int:
        """Number of vertices of all instances, with those of repeated primitives."""
        return sum(each.mesh.vertex_count for each in self.instances)

    def store_repeats(self) -> Scene:
        """Return the scene with repeated primitives of all meshes stored again, without directions."""
        meshes = {each.mesh: each.mesh.store_repeats() for each in self.instances}
        return replace(self, instances=tuple(replace(each, mesh=meshes[each.mesh]) for each in self.instances))

    def __repr__(self) -> str:
        counts = f"nodes={len(self.skeleton)}, instances={len(self.instances)}, vertices={self.vertex_count}"
        return f"Scene({counts})"
