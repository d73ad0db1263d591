"""Surfaces and shells on a reduced skeleton: those that follow one node rigidly become one group of points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.measure.error.displacement import MaxDisplacement
from anim.measure.error.point_groups import Binding, SkinnedGroups
from anim.measure.error.reduced_skeleton import IDENTITY, ReducedSkeleton
from anim.measure.error.surface import Surface


class RigidPoints(NamedTuple):
    """Points (V, 3) of a mesh, or around a node, in the space of the kept node that they follow."""

    name: str
    points: Floats


class MergedGroups(SkinnedGroups):
    """Points of several meshes, or of shells, that follow one node. vertices: whether they are those of meshes."""

    def __init__(self, node: int, rigid: Sequence[RigidPoints], *, vertices: bool) -> None:
        self._names = [each.name for each in rigid]
        self._firsts = np.cumsum([0, *(len(each.points) for each in rigid)])
        self.has_vertices = vertices
        points = np.concatenate([each.points for each in rigid])
        joints = np.zeros((len(points), 1), np.int64)
        targets = np.empty((0, len(points), 3))
        super().__init__(
            Surface(
                rigid[0].name,
                np.array([node]),
                IDENTITY,
                points,
                targets,
                joints,
                np.ones((len(points), 1)),
                -1,
                np.empty(0),
            )
        )

    def vertex(self, found: MaxDisplacement) -> int:
        """Return the index in its mesh of the vertex that was found, −1 for none."""
        point = super().vertex(found)
        return int(point - self._firsts[self._part(point)]) if self.has_vertices and point >= 0 else -1

    def name_of(self, found: MaxDisplacement) -> str:
        """Return the name of the mesh, or of a shell's node; of the first one if only a bound was evaluated."""
        return self._names[self._part(max(super().vertex(found), 0))]

    def _part(self, point: int) -> int:
        return int(np.searchsorted(self._firsts, point, side="right")) - 1


def merge_surfaces(
    surfaces: Sequence[tuple[Surface, Binding | None]], skeleton: ReducedSkeleton
) -> tuple[list[SkinnedGroups], int]:
    """Return the groups of surfaces, in two versions, on a reduced skeleton; and the number of vertices without one.

    The latter follow the world in both versions.
    """
    found: list[SkinnedGroups] = []
    rigid: list[Surface] = []
    for each, binding in surfaces:
        is_rigid = len(each.nodes) == 1 and not len(each.targets)
        surface, new = (each, None) if is_rigid and binding is None else _reduce(each, binding, skeleton)
        if is_rigid and new is None:
            rigid.append(each)
        else:
            found.append(SkinnedGroups(surface, new))
    merged, static = _merge_rigid(rigid, skeleton)
    return [*found, *merged], static


def _merge_rigid(surfaces: Sequence[Surface], skeleton: ReducedSkeleton) -> tuple[list[MergedGroups], int]:
    """The groups of surfaces with one joint each, in order of their nodes, and the number of vertices without one.

    Surfaces with equal numbers of points are moved at once, since scenes without meshes have one per node.
    """
    if not surfaces:
        return [], 0
    nodes = np.array([each.nodes[0] for each in surfaces])
    anchors, sizes = skeleton.anchors[nodes], np.array([len(each.points) for each in surfaces])
    bind = matrix.multiply(skeleton.offsets[nodes], np.concatenate([each.bind for each in surfaces]))
    moving = anchors != skeleton.origin
    points: dict[int, Floats] = {}
    for size in sorted(set(sizes[moving].tolist())):
        some = np.flatnonzero(moving & (sizes == size)).tolist()
        points.update(zip(some, matrix.apply(bind[some], np.stack([surfaces[i].points for i in some])), strict=True))
    rigid: dict[int, list[RigidPoints]] = {}
    for i in np.flatnonzero(moving).tolist():
        rigid.setdefault(int(anchors[i]), []).append(RigidPoints(surfaces[i].name, points[i]))
    groups = [MergedGroups(node, parts, vertices=True) for node, parts in rigid.items()]
    return groups, int(sizes[~moving].sum())


def merge_shells(nodes: Ints, points: Floats, names: Sequence[str], skeleton: ReducedSkeleton) -> list[MergedGroups]:
    """Return the groups of points (S, P, 3) around nodes (S,), in their spaces; without those that do not move."""
    anchors, moved = skeleton.anchors[nodes], matrix.apply(skeleton.offsets[nodes], points)
    found = []
    for anchor in sorted(set(anchors[anchors != skeleton.origin].tolist())):
        rigid = [RigidPoints(names[nodes[i]], moved[i]) for i in np.flatnonzero(anchors == anchor).tolist()]
        found.append(MergedGroups(anchor, rigid, vertices=False))
    return found


def _reduce(surface: Surface, binding: Binding | None, skeleton: ReducedSkeleton) -> tuple[Surface, Binding | None]:
    """A surface on kept nodes, and its joints in the second version if they differ."""
    anchors, offsets = skeleton.anchors, skeleton.offsets
    old = surface._replace(
        nodes=anchors[surface.nodes],
        bind=matrix.multiply(offsets[surface.nodes], surface.bind),
        owner=int(anchors[surface.owner]),
    )
    if binding is None:
        return old, None
    new = binding._replace(
        nodes=anchors[binding.nodes],
        bind=matrix.multiply(offsets[binding.nodes], binding.bind),
        owner=int(anchors[binding.owner]),
    )
    is_same = np.array_equal(new.nodes, old.nodes) and np.array_equal(new.bind, old.bind)
    return old, None if is_same and not len(surface.targets) else new
