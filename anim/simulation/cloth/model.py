"""Cloth to simulate: points with masses, the points that follow the animation, and what it collides with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.errors import NotFoundError
from anim.simulation.cloth.hierarchy import Hierarchy, build_hierarchy
from anim.simulation.cloth.tethers import order_outward, tether_lengths
from anim.simulation.cloth.topology import ClothTopology, build_topology
from anim.simulation.limits import (
    MAX_COEFFICIENT,
    MAX_COMPLIANCE_M_N,
    MAX_DENSITY,
    MAX_LENGTH_M,
    MAX_RATE_PER_S,
    check_range,
)

WELD_PER_DIAGONAL = 1e-6  # vertices closer than this fraction of the diagonal are one point
SELF_COLLISION_PER_EDGE = 0.9  # thickness, of the shortest edge


@dataclass(frozen=True, slots=True, eq=False)
class Fabric:
    """Material of a cloth.

    density: kg/m². stretch_compliance, bend_compliance: m/N; 0 is rigid. damping: 1/s. thickness: m, distance from
    colliders. friction: against colliders. Raises RangeError.
    """

    density: float = 0.2
    stretch_compliance: float = 1e-7
    bend_compliance: float = 1e-2
    damping: float = 0.3
    thickness: float = 0.005
    friction: float = 0.3

    def __post_init__(self) -> None:
        check_range("density", self.density, 0.0, MAX_DENSITY, "kg/m²", is_above=True)
        check_range("stretch_compliance", self.stretch_compliance, 0.0, MAX_COMPLIANCE_M_N, "m/N")
        check_range("bend_compliance", self.bend_compliance, 0.0, MAX_COMPLIANCE_M_N, "m/N")
        check_range("damping", self.damping, 0.0, MAX_RATE_PER_S, "per second")
        check_range("thickness", self.thickness, 0.0, MAX_LENGTH_M, "m")
        check_range("friction", self.friction, 0.0, MAX_COEFFICIENT)


@dataclass(frozen=True, slots=True, eq=False)
class ClothModel:
    """P points of a cloth.

    topology: of its mesh. rest: (P, 3) m, the shape without strain. inverse_masses: (P,) 1/kg, 0 for pinned points.
    pinned: (N,) indices of points that follow the animation. edge_lengths, hinge_lengths: (E,), (H,) m at rest.
    anchors, tethers: for each point K pinned ones, the nearest first, −1 for none, and the lengths along the mesh,
    (P, K) m. outward: (E,) indices of the edges, those near pinned points first.
    hierarchy: limits between distant points. self_collision: m, distance that points keep from each other; 0 for none.
    """

    topology: ClothTopology
    rest: Floats
    inverse_masses: Floats
    pinned: Ints
    edge_lengths: Floats
    hinge_lengths: Floats
    anchors: Ints
    tethers: Floats
    outward: Ints
    hierarchy: Hierarchy
    self_collision: float

    @property
    def masses(self) -> Floats:
        """The masses (P,) kg of the points, 0 for pinned ones."""
        return np.where(self.inverse_masses > 0, 1 / np.maximum(self.inverse_masses, 1e-300), 0.0)


def build_cloth(
    positions: Floats, faces: Ints, pinned: Bools, fabric: Fabric, *, self_collision: bool = False
) -> ClothModel:
    """Return the cloth of vertices (V, 3) m and faces (T, 3); pinned: (V,) vertices that follow the animation.

    Raises NotFoundError for a mesh without edges, or where every point is pinned.
    """
    diagonal = float(np.linalg.norm(np.ptp(positions, axis=0))) if len(positions) else 0.0
    topology = build_topology(positions, faces, WELD_PER_DIAGONAL * diagonal)
    x = positions[topology.first_vertex]
    fixed = np.zeros(len(x), bool)
    np.logical_or.at(fixed, topology.point_of_vertex, pinned)
    inverse = 1.0 / _masses(x, topology.faces, fabric.density)
    used = np.zeros(len(x), bool)
    used[topology.faces] = True
    fixed |= ~used  # points without faces have no mass and stay with the mesh
    if fixed.all():
        raise NotFoundError("every point of the cloth is pinned: there is nothing to simulate")
    inverse[fixed] = 0.0
    indices = np.flatnonzero(fixed & used)
    anchors, tethers = tether_lengths(topology, x, indices)
    outward = order_outward(topology.edges, tethers[:, 0])
    hierarchy = build_hierarchy(topology, x, fixed)
    edge_lengths, hinge_lengths = _lengths(x, topology.edges), _lengths(x, topology.hinges)
    gap = SELF_COLLISION_PER_EDGE * float(edge_lengths.min()) if self_collision else 0.0
    return ClothModel(
        topology,
        x,
        inverse,
        np.flatnonzero(fixed),
        edge_lengths,
        hinge_lengths,
        anchors,
        tethers,
        outward,
        hierarchy,
        gap,
    )


def _lengths(x: Floats, pairs: Ints) -> Floats:
    return np.asarray(np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1))


def _masses(x: Floats, faces: Ints, density: float) -> Floats:
    """A third of each face's mass at its points (P,); tiny where a point has no area."""
    corners = x[faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    mass = np.bincount(faces.ravel(), np.repeat(density * area / 3, 3), minlength=len(x))
    return np.maximum(mass, 1e-9 * max(float(mass.max(initial=0.0)), 1e-12))
