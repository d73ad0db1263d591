"""Skin, Mesh and Scene: what a skeleton carries, and where vertices come from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim import arrays
from anim.arrays import Floats, Ints
from anim.errors import FormatError, ShapeError
from anim.model.skeleton import Skeleton

SUM_TOLERANCE = 1e-3  # how far a vertex's skin weights may be from adding up to 1: more than rounding leaves


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """Joints of a skin and the matrices that take mesh space to each joint's space at bind time.

    joints: (J,) node numbers. inverse_bind: (J, 3, 4).
    """

    joints: Ints
    inverse_bind: Floats

    def __post_init__(self) -> None:
        if len(self.joints) != len(self.inverse_bind):
            raise ShapeError(f"{len(self.inverse_bind)} inverse bind matrices for {len(self.joints)} joints")

    def __repr__(self) -> str:
        return f"Skin(joints={len(self.joints)})"


@dataclass(frozen=True, slots=True)
class PrimitiveRange:
    """How many vertices and faces of a mesh are one primitive's. material: its number in the file, −1 for none."""

    vertices: int
    faces: int
    material: int = -1


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Vertices of all primitives of a glTF mesh, one after another.

    positions: (V, 3) m. faces: (T, 3). joints, weights: (V, I), I = 0 without a skin; weights ≥ 0, of each vertex
    adding up to 1.
    targets: (M, V, 3) morph displacements. rest_weights: (M,) of the mesh. normals: (V, 3), or None where any
    lacks or they were not read.
    tangents: (V, 4) xyz and handedness ±1, like normals. normal_targets, tangent_targets: (M, V, 3) what morph targets
    add to normals and tangents, or None where they add nothing.
    primitives: in the order of the file; empty where unknown. weight_sums: (V,) what weights added up to in the file,
    where that is another number than 1 for any vertex and not by rounding.
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

    def __post_init__(self) -> None:
        arrays.check_shape(self.positions, "V 3", name="positions")
        where = f"mesh '{self.name}'" if self.name else ""
        if len(self.weights) and self.weights.size and self.weights.min() < 0:
            raise FormatError(f"a skin weight is negative ({self.weights.min():g})", where=where)
        if self.weights.size and (off := np.abs(self.weights.sum(axis=1) - 1)).max() > SUM_TOLERANCE:
            v = int(off.argmax())
            raise ShapeError(f"skin weights of vertex {v} add up to {self.weights[v].sum():g} (expected 1)")
        if self.faces.size and int(self.faces.max()) >= len(self.positions):
            raise FormatError(f"a face uses vertex {self.faces.max()} (of {len(self.positions)})", where=where)

    def __repr__(self) -> str:
        counts = f"vertices={len(self.positions)}, faces={len(self.faces)}, targets={len(self.targets)}"
        return f"Mesh({self.name!r}, {counts})"


@dataclass(frozen=True, slots=True, eq=False)
class MeshInstance:
    """A mesh on a node; with a skin, the joints place the vertices and the node does not count.

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
    """The skeleton and every mesh instance, in depth-first order of nodes."""

    skeleton: Skeleton
    instances: tuple[MeshInstance, ...]

    @property
    def vertex_count(self) -> int:
        """Number of vertices of all instances."""
        return int(np.sum([len(i.mesh.positions) for i in self.instances], dtype=np.int64))

    def __repr__(self) -> str:
        counts = f"nodes={len(self.skeleton)}, instances={len(self.instances)}, vertices={self.vertex_count}"
        return f"Scene({counts})"
