"""Shells: six points around each node that moves no vertex, such as a socket, a camera or a light."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.measure.error.displacement import BoundGroups, DisplacementField, MaxDisplacement, SkinnedDisplacement
from anim.measure.error.orientation_probes import shell_points
from anim.measure.error.surface import Surface
from anim.model import Skeleton
from anim.sampling.pose import PosedSkeleton


class ShellPoints:
    """Six points at `radius` (m, in the rest pose) along the axes of some nodes, each node a group.

    nodes, partners: (S,) their indices in the scenes before and after. points: (S, 6, 3) m, in the nodes' spaces.
    reach: of each group its node, as an index into `nodes`. bound_groups: the points, in the nodes' spaces.
    """

    def __init__(self, skeleton: Skeleton, nodes: Ints, partners: Ints, radius: float) -> None:
        self.nodes, self.partners = nodes, partners
        points = shell_points(skeleton, nodes, radius)
        whole = np.concatenate((points, np.ones((len(nodes), 6, 1))), axis=-1)
        self.points = points
        self.groups: list[Ints] = [np.arange(6, dtype=np.int64)] * len(nodes)
        self.reach: list[Ints] = [np.array([i]) for i in range(len(nodes))]
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
        """Return −1: these points are no vertices."""
        del found
        return -1


def nodes_without_vertices(skeleton: Skeleton, surfaces: list[Surface]) -> Bools:
    """Return the mask (N,) of nodes that influence no vertex, and none of whose descendants does.

    A node with a skinned mesh is not among them either: its own position has no effect.
    """
    shown = np.zeros(len(skeleton), np.bool_)
    for surface in surfaces:
        shown[surface.nodes[surface.joints[surface.weights > 0]]] = True
    for level in reversed(skeleton.levels()[1:]):
        shown[skeleton.parents[level[shown[level]]]] = True
    shown[[surface.owner for surface in surfaces]] = True
    return ~shown
