"""Surfaces and shells on a reduced skeleton: those that follow one node rigidly become one group of points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import matrix
from anim.measure.error.max_displacement import MaxDisplacement
from anim.measure.error.point_groups import Binding, SkinnedGroups
from anim.measure.error.reduced_skeleton import IDENTITY, ReducedSkeleton
from anim.measure.error.surface import Surface


class MergedGroups(SkinnedGroups):
    """Points of several meshes, or around several nodes, that follow one kept node, in its space.

    counts: number of points of each mesh or node, whose name `called` gives by its place there. points: (V, 3) m, of
    one after the other. vertices: whether they are those of meshes, or stand for such.
    """

    def __init__(
        self, node: int, counts: Ints, points: Floats, called: Callable[[int], str], *, vertices: bool
    ) -> None:
        self._called = called
        self._firsts = np.concatenate(([0], np.cumsum(counts)))
        self.has_vertices = vertices
        one = (len(points), 1)
        super().__init__(
            Surface(
                called(0),
                np.array([node]),
                IDENTITY,
                points,
                np.empty((0, len(points), 3)),
                np.broadcast_to(np.int64(0), one),
                np.broadcast_to(1.0, one),
                -1,
                np.empty(0),
            )
        )

    def vertex(self, found: MaxDisplacement) -> int:
        """Return the index in its mesh of the vertex that was found, −1 for none."""
        point = super().vertex(found)
        return int(point - self._firsts[self._part(point)]) if self.has_vertices and point >= 0 else -1

    def is_shell(self, group: int) -> bool:
        """Return whether the points are around nodes that move no vertex."""
        del group
        return not self.has_vertices

    def name_of(self, found: MaxDisplacement) -> str:
        """Return the name of the mesh, or of a shell's node; of the first one if only a bound was evaluated."""
        return self._called(self._part(max(super().vertex(found), 0)))

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
        is_same = binding is None or _has_joints(each, binding)
        surface, new = (each, None) if is_rigid and is_same else _reduce(each, binding, skeleton)
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
    groups = []
    for anchor, members in _by_anchor(anchors, moving):
        all_points = np.concatenate([points[i] for i in members.tolist()])
        names = [surfaces[i].name for i in members.tolist()]
        groups.append(MergedGroups(anchor, sizes[members], all_points, names.__getitem__, vertices=True))
    return groups, int(sizes[~moving].sum())


def merge_points(
    nodes: Ints, points: Floats, called: Callable[[int], str], skeleton: ReducedSkeleton, *, vertices: bool
) -> list[MergedGroups]:
    """Return the groups of points (S, P, 3) around nodes (S,), in their spaces; without those that do not move.

    called: gives the name of a node. vertices: whether the points stand for vertices.
    """
    anchors = skeleton.anchors[nodes]
    members = _by_anchor(anchors, anchors != skeleton.origin)
    chosen = np.concatenate([np.empty(0, np.int64), *(each for _, each in members)])
    moved = matrix.apply(skeleton.offsets[nodes[chosen]], points[chosen])
    ends = np.cumsum([len(each) for _, each in members])
    found = []
    for (anchor, each), end in zip(members, ends.tolist(), strict=True):
        own = moved[end - len(each) : end].reshape(-1, 3)
        name = partial(_called_member, called, nodes[each])
        found.append(MergedGroups(anchor, np.full(len(each), points.shape[1]), own, name, vertices=vertices))
    return found if vertices else sorted(found, key=lambda each: each.node(0))


def _called_member(called: Callable[[int], str], nodes: Ints, place: int) -> str:
    return called(int(nodes[place]))


def _by_anchor(anchors: Ints, moving: Bools) -> list[tuple[int, Ints]]:
    """Each anchor of the moving members with their indices, in the order of the first of each."""
    chosen = np.flatnonzero(moving)
    chosen = chosen[np.argsort(anchors[chosen], kind="stable")]
    members = np.split(chosen, np.flatnonzero(np.diff(anchors[chosen])) + 1) if len(chosen) else []
    return sorted(((int(anchors[each[0]]), each) for each in members), key=lambda each: int(each[1][0]))


def _reduce(surface: Surface, binding: Binding | None, skeleton: ReducedSkeleton) -> tuple[Surface, Binding | None]:
    """A surface on kept nodes, and its joints in the second version if they differ."""
    anchors, offsets = skeleton.anchors, skeleton.offsets
    if not len(surface.targets) and (binding is None or _has_joints(surface, binding)):
        return _merge_joints(surface, skeleton), None
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
    return old, None if _has_joints(old, new) and not len(surface.targets) else new


def _merge_joints(surface: Surface, skeleton: ReducedSkeleton) -> Surface:
    """A surface without morph targets on kept nodes: joints that follow the same one are one joint.

    Its points (V, I, 3) are those of each influence, in the space of the kept node.
    """
    anchors = skeleton.anchors[surface.nodes]
    nodes = np.flatnonzero(np.bincount(anchors))
    to_anchor = matrix.multiply(skeleton.offsets[surface.nodes], surface.bind)
    points = matrix.apply(to_anchor[surface.joints], surface.points[:, None, None])[:, :, 0]
    return surface._replace(
        nodes=nodes,
        bind=np.broadcast_to(IDENTITY, (len(nodes), 3, 4)),
        points=points[:, 0] if points.shape[1] == 1 else points,  # which may be rigid now
        joints=np.searchsorted(nodes, anchors)[surface.joints],
        owner=int(skeleton.anchors[surface.owner]),
    )


def _has_joints(surface: Surface, binding: Binding) -> bool:
    return np.array_equal(binding.nodes, surface.nodes) and np.array_equal(binding.bind, surface.bind)
