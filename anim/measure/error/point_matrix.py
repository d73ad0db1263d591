"""Points on which an error is measured, as one matrix from the motion of nodes to that of points.

A skinned vertex is at Σ w·M·b·p: linear in the joints' world matrices M. With one row per vertex and four columns
per node (x, y, z and 1 of w·b·p), the displacements of all vertices at all times are a single matrix product.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Set
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from anim.arrays import Floats, Ints, unique_sorted
from anim.measure.error.orientation_probes import shell_points as shells_of
from anim.measure.error.point_rows import OneJointRows, PointRows, stack_blocks, stack_points
from anim.measure.error.surface import Surface, has_vertices, merge_small_surfaces, surfaces
from anim.model import Scene

CARRIED = 0.1  # minimum weight with which a vertex represents a node
DIRECTIONS = np.vstack((np.eye(3), -np.eye(3)))
CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
ALL_DIRECTIONS = np.vstack((DIRECTIONS, CORNERS))
MIN_FOLLOWERS = 1000  # nodes that follow one moving node, of which only the outermost are sampled
DENSE = 4_000_000  # values; a larger matrix is stored as a sparse one


@dataclass(frozen=True)
class PointMatrix:
    """P points on J nodes, each on up to I of them.

    nodes: (J,), increasing. joints: (P, I) into `nodes`. factors: (P, I, 4): weight times the point in the joint's own
    space, and the weight itself; 0 where a point has fewer joints.
    """

    nodes: Ints
    joints: Ints
    factors: Floats

    def __len__(self) -> int:
        return len(self.joints)

    def rows(self) -> PointRows:
        """Return the matrix (P, 4 J), float32, from stacked columns of node matrices to positions."""
        return self._rows

    @cached_property
    def _rows(self) -> PointRows:
        return PointRows(self._matrix.astype(np.float32))

    def squares(self, differences: Callable[[Ints], Floats]) -> Floats:
        """Return the squared lengths (P, F) of displacements, in float32; in float64 if some are beyond it.

        differences: gives those of world matrices (J, F, 3, 4) of nodes (J,).
        """
        found = self._rows.squares(stack_blocks(differences, self.nodes, np.float32))
        if np.isfinite(found).all():
            return found
        return PointRows(self._matrix).squares(stack_blocks(differences, self.nodes, np.float64))

    @cached_property
    def _matrix(self) -> Any:
        """The same in float64: dense, sparse, or of one joint per row."""
        width = self.joints.shape[1]
        if width == 1 and 16 * len(self) * len(self.nodes) > DENSE:
            return OneJointRows(self.joints[:, 0], self.factors[:, 0])
        row = np.repeat(np.arange(len(self)), 4 * width)
        column = (4 * self.joints[..., None] + np.arange(4)).reshape(-1)
        shape = (len(self), 4 * len(self.nodes))
        values = self.factors.reshape(-1)
        if shape[0] * shape[1] > DENSE:
            from scipy.sparse import csr_array

            return csr_array((values, (row, column)), shape=shape)
        dense = np.zeros(shape)
        np.add.at(dense, (row, column), values)
        return dense

    def take(self, chosen: Ints) -> PointMatrix:
        """Return some of the points, by index."""
        return PointMatrix(self.nodes, self.joints[chosen], self.factors[chosen])

    def by_joint(self) -> PointMatrix:
        """Return the points in the order of the joints with their largest weights."""
        if not len(self):
            return self
        most = self.factors[..., 3].argmax(axis=1)
        return self.take(np.argsort(self.joints[np.arange(len(self)), most], kind="stable"))

    def rebind(self, bindings: Ints, offsets: Floats) -> PointMatrix:
        """Return the same points on other nodes: `bindings[n]` (N,) instead of n.

        offsets: (N, 3, 4) from the space of the old node to that of the new one.
        """
        nodes, place = np.unique(bindings[self.nodes], return_inverse=True)
        moved = np.einsum("piab,pib->pia", offsets[self.nodes][self.joints], self.factors)
        factors = np.concatenate((moved, self.factors[..., 3:]), axis=-1)
        return PointMatrix(nodes, place.reshape(-1)[self.joints], factors)

    def distinct(self, labels: Ints) -> Ints:
        """Return the indices of points (increasing) that differ from all before them with the same label (P,)."""
        rows = np.column_stack((labels, self.joints, self.factors.reshape(len(self), -1)))
        first: dict[bytes, int] = {}
        for i, row in enumerate(rows):
            first.setdefault(row.tobytes(), i)
        return np.array(list(first.values()), np.int64)

    def places(self, world: Floats) -> Floats:
        """Return the positions of the points (P, F, 3), from the world matrices (N, F, 3, 4) of all nodes."""
        places = self._matrix @ stack_points(world, self.nodes)
        return np.swapaxes(places.reshape(len(self), 3, world.shape[1]), 1, 2)


def sample_points(
    scene: Scene, shells: Set[int], radius: float, extra: Set[tuple[int, int]] = frozenset()
) -> PointMatrix:
    """Return the outermost vertices of the scene, and six points `radius` m around each node in `shells`.

    Of vertices: for each joint and each of 14 directions of its space, the farthest of those with their largest weight
    on it, and of all with a noticeable weight. extra: further vertices, (index of the surface, index of the vertex).
    """
    found = surfaces(scene) if has_vertices(scene) else []
    firsts = np.cumsum([0, *(len(surface.points) for surface in found)])
    more = np.array([firsts[owner] + vertex for owner, vertex in extra], np.int64)
    parts, start = [], 0
    for surface in merge_small_surfaces(found):
        end = start + len(surface.points)
        wanted = extreme_vertices(surface) | set((more[(start <= more) & (more < end)] - start).tolist())
        parts.append(_of_surface(surface, np.array(sorted(wanted), np.int64)))
        start = end
    return _joined([*parts, *_shells(scene, shells, radius)])


def all_points(scene: Scene, radius: float) -> PointMatrix:
    """Return all vertices of the scene by surface; without vertices, six points around every node."""
    if has_vertices(scene):
        found = merge_small_surfaces(surfaces(scene))
        return _joined([_of_surface(surface, np.arange(len(surface.points))) for surface in found])
    return _joined(_shells(scene, frozenset(range(len(scene.skeleton))), radius))


def _shells(scene: Scene, nodes: Set[int], radius: float) -> list[tuple[Ints, Floats]]:
    """Nodes (P, 1) and factors (P, 1, 4) of all points around some nodes, as one part."""
    if not nodes:
        return []
    around = np.array(sorted(nodes), np.int64)
    ends = shells_of(scene.skeleton, around, radius)
    factors = np.ones((ends.shape[0] * ends.shape[1], 1, 4))
    factors[:, 0, :3] = ends.reshape(-1, 3)
    return [(np.repeat(around, ends.shape[1])[:, None], factors)]


def _joined(parts: list[tuple[Ints, Floats]]) -> PointMatrix:
    if not parts:
        return PointMatrix(np.empty(0, np.int64), np.empty((0, 1), np.int64), np.empty((0, 1, 4)))
    nodes = np.flatnonzero(np.bincount(np.concatenate([nodes.reshape(-1) for nodes, _ in parts])))
    if len(parts) == 1:
        ((own, factors),) = parts
        return PointMatrix(nodes, np.searchsorted(nodes, own), factors)
    count, width = sum(len(own) for own, _ in parts), max(own.shape[1] for own, _ in parts)
    joints: Ints = np.full((count, width), nodes[0] if len(nodes) else 0, np.int64)
    factors = np.zeros((count, width, 4))
    at = 0
    for own, each in parts:  # of files with many meshes: few calls for each
        some = slice(at, at + len(own)), slice(own.shape[1])
        joints[some], factors[some] = own, each
        at += len(own)
    return PointMatrix(nodes, np.searchsorted(nodes, joints), factors)


def outermost_nodes(anchors: Ints, nodes: Ints, places: Floats) -> Ints:
    """Return those of S nodes that are the outermost of all that follow the same moving node.

    anchors: (S,) that node. nodes: (S,) increasing. places: (N, 3) m, of all nodes in the rest pose. Where few follow
    one, all of them; else the farthest in each of 14 directions: a displacement is largest at a corner of the hull.
    """
    chosen = [nodes[:0]]
    order = np.argsort(anchors, kind="stable")
    for some in np.split(nodes[order], np.flatnonzero(np.diff(anchors[order])) + 1):
        if len(some) >= MIN_FOLLOWERS:
            some = some[(places[some] @ ALL_DIRECTIONS.T).argmax(axis=0)]
        chosen.append(some)
    return unique_sorted(np.concatenate(chosen))


def extreme_vertices(surface: Surface) -> set[int]:
    """Return the indices of the outermost vertices of each joint's part of a surface."""
    chosen: set[int] = set()
    every = np.arange(len(surface.points))
    used = np.flatnonzero(np.bincount(surface.joints[surface.weights > 0]))
    most = surface.joints[every, surface.weights.argmax(axis=1)]
    vertices, places = np.nonzero(surface.weights > CARRIED)
    noticed = surface.joints[vertices, places]
    of_joints = zip(used, _by_joint(used, most, every), _by_joint(used, noticed, vertices), strict=True)
    for joint, mine, here in of_joints:
        for some in (mine,) if np.array_equal(mine, here) else (mine, here):
            if len(some):
                local = surface.points[some] @ surface.bind[joint][:, :3].T
                chosen.update(some[(local @ ALL_DIRECTIONS.T).argmax(axis=0)].tolist())
    return chosen


def _by_joint(wanted: Ints, joints: Ints, vertices: Ints) -> Iterator[Ints]:
    """For each wanted joint the vertices (increasing) beside which it stands in `joints` (P,)."""
    size = int(vertices.max(initial=0)) + 1
    pairs = unique_sorted(joints * size + vertices)
    ends = np.searchsorted(pairs, [wanted * size, (wanted + 1) * size])
    return (pairs[start:end] % size for start, end in ends.T.tolist())


def _of_surface(surface: Surface, vertices: Ints) -> tuple[Ints, Floats]:
    """Nodes (P, I) and factors (P, I, 4) of some vertices, morphed as in the rest pose."""
    points = surface.points[vertices]
    if len(surface.rest_weights):
        points = points + np.tensordot(surface.rest_weights, surface.targets[:, vertices], axes=1)
    joints, weights = surface.joints[vertices], surface.weights[vertices]
    bind = surface.bind[joints]
    factors = np.ones((*joints.shape, 4))
    factors[..., :3] = np.einsum("viab,vb->via", bind[..., :3], points) + bind[..., 3]
    return surface.nodes[joints], factors * weights[..., None]
