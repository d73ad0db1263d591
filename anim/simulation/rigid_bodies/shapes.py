"""Shapes under a scale, and points of shapes that only a hull represents."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.memory import MemoryBudget
from anim.model import Mesh
from anim.simulation.rigid_bodies.description import Shape

SCALE_TOLERANCE = 1e-4  # relative difference of scales that counts as none: float32 rounding
SAME_SCALE = 1e-9  # relative difference of scales that is rounding of rotations
CIRCLE_POINTS, ARC_POINTS = 32, 7
POINT_BYTES, TRIANGLE_BYTES = 60, 250  # with their copies here, and in the engine's float32 and bounding volumes


def mesh_shape(mesh: Mesh, kind: str, weights: Floats | None = None) -> Shape:
    """Return the shape of a mesh: its "mesh" or "hull", or the "box" or "sphere" around its vertices.

    weights: (M,) of its morph targets, by default the mesh's. Raises RangeError for a mesh without faces.
    """
    chosen = mesh.rest_weights if weights is None else weights
    points = mesh.positions + np.tensordot(chosen, mesh.targets, 1) if len(mesh.targets) else mesh.positions
    used = Shape("mesh", points=np.asarray(points, np.float64), faces=mesh.faces)
    if kind == "mesh":
        return used
    corners = used.points[np.unique(used.faces)]
    if kind == "hull":
        return Shape("hull", points=corners)
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y, z = ((low + high) / 2).tolist()
    if kind == "box":
        return Shape("box", tuple((high - low).tolist()), center=(x, y, z))
    radius = np.linalg.norm(corners - (x, y, z), axis=1).max()
    return Shape("sphere", (float(radius),), center=(x, y, z))


def join_meshes(shapes: list[Shape]) -> Shape:
    """Return one shape of several of kind "mesh"."""
    offsets = np.cumsum([0, *(len(each.points) for each in shapes[:-1])])
    faces = [each.faces + offset for each, offset in zip(shapes, offsets, strict=True)]
    return Shape("mesh", points=np.concatenate([each.points for each in shapes]), faces=np.concatenate(faces))


def scale_shape(shape: Shape, linear: Floats) -> Shape:
    """Return a shape under scale and shear (3, 3), of which shapes with a size use the lengths of the axes.

    A sphere, capsule or cylinder that is no longer one becomes the hull of its points. Mirroring keeps faces outward.
    """
    if shape.kind in ("hull", "mesh"):
        faces = shape.faces[:, ::-1] if np.linalg.det(linear) < 0 else shape.faces
        return Shape(shape.kind, points=shape.points @ linear.T, faces=faces)
    scale = np.linalg.norm(linear, axis=0)
    x, y, z = (linear @ np.array(shape.center)).tolist()
    if shape.kind == "plane":
        return Shape("plane", center=(x, y, z))
    if shape.kind == "box":
        return Shape("box", tuple((np.array(shape.size) * scale).tolist()), center=(x, y, z))
    across = np.ptp(scale if shape.kind != "cylinder" else scale[[0, 2]])
    tapered = len(shape.size) == 3 and shape.size[1] != shape.size[2]
    if tapered or across > SCALE_TOLERANCE * scale.max():
        return Shape("hull", points=(surface_points(shape) + shape.center) @ linear.T)
    factors = scale[[1, 0, 0]] if len(shape.size) == 3 else scale[:1]
    return Shape(shape.kind, tuple((np.array(shape.size) * factors).tolist()), center=(x, y, z))


def count_bytes(shape: Shape) -> int:
    """Return the bytes that points and faces take, here and in the engine."""
    return POINT_BYTES * len(shape.points) + TRIANGLE_BYTES * len(shape.faces)


class ScaledShapes:
    """Shapes under scales: one object for one shape and scale, so that instances of a mesh share points and hull."""

    def __init__(self) -> None:
        self._made: dict[tuple[Shape, bytes], Shape] = {}
        self._seen: set[Shape] = set()
        self._copied_bytes = 0

    def scale(self, shape: Shape, linear: Floats) -> Shape:
        """Return the shape under a scale (3, 3); of points, under one that differs by less than SAME_SCALE.

        Raises UnsupportedError if the same points under many scales take more than the limit of memory.
        """
        if shape.kind not in ("hull", "mesh"):
            return scale_shape(shape, linear)
        if np.abs(linear - np.eye(3)).max() < SAME_SCALE:
            return shape
        size = float(f"{np.abs(linear).max():.9g}")
        key = shape, np.append(np.round(linear / size / SAME_SCALE) + 0.0, size).tobytes()  # no negative zeros
        if key not in self._made:
            self._count(shape)
            self._made[key] = scale_shape(shape, linear)
        return self._made[key]

    def _count(self, shape: Shape) -> None:
        """Count a copy of a shape beside its first one, which is as large as the file's."""
        self._copied_bytes += count_bytes(shape) if shape in self._seen else 0
        self._seen.add(shape)
        MemoryBudget(0).check(
            self._copied_bytes,
            "meshes of colliders under different scales",
            help="choose boxes, or raise `memory_limit`",
        )


def surface_points(shape: Shape) -> Floats:
    """Return points (V, 3) of a sphere, capsule or cylinder of any radii, whose hull is the shape."""
    if shape.kind == "cylinder":
        height, bottom, top = shape.size
        return np.concatenate([_ring(bottom, -height / 2), _ring(top, height / 2)])
    height, bottom, top = shape.size if shape.kind == "capsule" else (0.0, shape.size[0], shape.size[0])
    rings = []
    for radius, side in ((bottom, -1.0), (top, 1.0)):
        for angle in np.linspace(0, np.pi / 2, ARC_POINTS):
            rings.append(_ring(radius * np.cos(angle), side * (height / 2 + radius * np.sin(angle))))
    return np.concatenate(rings)


def _ring(radius: float, y: float) -> Floats:
    angles = np.arange(CIRCLE_POINTS) * (2 * np.pi / CIRCLE_POINTS)
    return np.stack([radius * np.cos(angles), np.full(CIRCLE_POINTS, y), radius * np.sin(angles)], axis=1)
