"""Points around nodes: shells of those that move no vertex, such as a socket, a camera or a light, or cubes of all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hierarchy
from anim.measure.error.displacement import BoundGroups, DisplacementField, SkinnedDisplacement
from anim.measure.error.max_displacement import MaxDisplacement
from anim.measure.error.orientation_probes import shell_points
from anim.measure.error.surface import NUM_CORNERS, Surface, node_cubes
from anim.model import Scene, Skeleton
from anim.sampling.pose import PosedSkeleton


class ShellPoints:
    """P points around each of some nodes, each node a group.

    nodes, partners: (S,) their indices in the scenes before and after. points: (S, P, 3) m, in the nodes' spaces.
    has_vertices: whether they stand for vertices, as the cubes of a scene without any do; shells don't.
    reach: of each group its node, as an index into `nodes`. bound_groups: the points, in the nodes' spaces.
    """

    def __init__(self, nodes: Ints, partners: Ints, points: Floats, *, has_vertices: bool = False) -> None:
        self.nodes, self.partners, self.points, self.has_vertices = nodes, partners, points, has_vertices
        whole = np.concatenate((points, np.ones((*points.shape[:2], 1))), axis=-1)
        self.groups: list[Ints] = [np.arange(points.shape[1])] * len(nodes)
        self.reach: list[Ints] = list(np.arange(len(nodes))[:, None])
        self.bound_groups = BoundGroups(self.reach, list(whole), points)

    @property
    def name(self) -> str:
        """Empty: each group has the name of its node."""
        return ""

    def name_of(self, found: MaxDisplacement) -> str:
        """Return an empty name: each group has that of its node."""
        del found
        return self.name

    def field(self, old: PosedSkeleton, new: PosedSkeleton) -> DisplacementField | None:
        """Return the displacement of the points at every time, None without points."""
        if not len(self.nodes) or not len(old.pose.times):
            return None
        return SkinnedDisplacement(self.bound_groups, new.world[self.partners] - old.world[self.nodes])

    def weights(self, old: PosedSkeleton, new: PosedSkeleton) -> list[tuple[int, Floats, Floats]]:
        """Return an empty list: shells are not morphed."""
        del old, new
        return []

    def leader(self, group: int) -> int:
        """Return the index of a group's node, in the first scene."""
        return self.node(group)

    def node(self, joint: int) -> int:
        """Return the index of a group's node, in the first scene."""
        return int(self.nodes[joint])

    def vertex(self, found: MaxDisplacement) -> int:
        """Return the index of the point that was found, −1 of a shell: its points are no vertices."""
        return found.vertex if self.has_vertices else -1

    def is_shell(self, group: int) -> bool:
        """Return whether the points are around nodes that move no vertex: all or none."""
        del group
        return not self.has_vertices


def nodes_without_vertices(skeleton: Skeleton, surfaces: Sequence[Surface]) -> Bools:
    """Return the mask (N,) of nodes that influence no vertex, and none of whose descendants does.

    A node with a skinned mesh is not among them either: its own position has no effect.
    """
    shown = np.zeros(len(skeleton), np.bool_)
    for surface in surfaces:
        shown[surface.nodes[surface.joints[surface.weights > 0]]] = True
    shown = hierarchy.with_ancestors(skeleton.parents, shown)
    shown[[surface.owner for surface in surfaces]] = True
    return ~shown


def points_around_nodes(
    scene: Scene, partners: Ints, surfaces: Sequence[Surface], shell: float | None, diagonal: float
) -> tuple[Ints, Floats]:
    """Return the nodes (S,) that are measured at points (S, P, 3) around them, in their spaces.

    On shells those without vertices; on cubes all of a scene without any surface. partners: (N,) of nodes in the other
    scene, −1 without one. shell: m, None for no shells. diagonal: m, of the scene.
    """
    if shell is not None:
        nodes = np.flatnonzero(nodes_without_vertices(scene.skeleton, surfaces) & (partners >= 0))
        return nodes, shell_points(scene.skeleton, nodes, shell)
    if surfaces:
        return np.empty(0, np.int64), np.empty((0, NUM_CORNERS, 3))
    return np.arange(len(scene.skeleton)), node_cubes(scene, diagonal)
