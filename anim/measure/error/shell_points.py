"""Six points around each node that no vertex shows: a socket, a camera or a light must not move by accident either."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.measure.error.displacement import BoundGroups, DisplacementField, MaxDisplacement, SkinnedDisplacement
from anim.measure.error.orientation_probes import shell_points
from anim.measure.error.point_groups import PosedScene
from anim.measure.error.surface import Surface
from anim.model import Skeleton


class ShellPoints:
    """Six points at `radius` (m, in the rest pose) along the axes of some nodes, each a group of its own.

    nodes, partners: (S,) their numbers in the scenes before and after. points: (S, 6, 3) m, in the nodes' spaces.
    reach: of each group its node, as a place in `nodes`.
    """

    def __init__(self, skeleton: Skeleton, nodes: Ints, partners: Ints, radius: float) -> None:
        self.nodes, self.partners = nodes, partners
        points = shell_points(skeleton, nodes, radius)
        whole = np.concatenate((points, np.ones((len(nodes), 6, 1))), axis=-1)
        self.points = points
        self.groups: list[Ints] = [np.arange(6, dtype=np.int64)] * len(nodes)
        self.reach: list[Ints] = [np.array([i]) for i in range(len(nodes))]
        self._groups = BoundGroups(self.reach, list(whole), points)

    @property
    def name(self) -> str:
        """Return nothing: each group is named by its node."""
        return ""

    def field(self, old: PosedScene, new: PosedScene) -> DisplacementField | None:
        """Return how far the points are displaced at every time, None where there are none."""
        if not len(self.nodes) or not len(old.pose.times):
            return None
        return SkinnedDisplacement(self._groups, new.world[self.partners] - old.world[self.nodes])

    def weights(self, old: PosedScene, new: PosedScene) -> list[tuple[int, Floats, Floats]]:
        """Return nothing: shells are not morphed."""
        del old, new
        return []

    def leader(self, group: int) -> int:
        """Return the number of the node of a group, in the scene before."""
        return self.node(group)

    def node(self, joint: int) -> int:
        """Return the number of the node of a group, in the scene before."""
        return int(self.nodes[joint])

    def vertex(self, found: MaxDisplacement) -> int:
        """Return −1, for these points are no vertices."""
        del found
        return -1


def nodes_without_vertices(skeleton: Skeleton, surfaces: list[Surface]) -> Bools:
    """Return which nodes (N,) carry no vertex, nor does any node that hangs on them.

    A node that holds a skinned mesh is none of them either: where it is does not count.
    """
    shown = np.zeros(len(skeleton), np.bool_)
    for surface in surfaces:
        shown[surface.nodes[surface.joints[surface.weights > 0]]] = True
    for level in reversed(skeleton.levels()[1:]):
        shown[skeleton.parents[level[shown[level]]]] = True
    shown[[surface.owner for surface in surfaces]] = True
    return ~shown
