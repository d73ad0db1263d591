"""Several surfaces without morph targets as one: their displacements are computed in the same products."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.measure.error.displacement import BoundGroups, DisplacementField, SkinnedDisplacement
from anim.measure.error.max_displacement import MaxDisplacement
from anim.measure.error.point_groups import PointGroups, SkinnedGroups
from anim.measure.error.shell_points import ShellPoints
from anim.sampling.pose import PosedSkeleton

NUM_CORNERS = 8  # of a joint's box
IDENTITY = np.eye(4)[:3]


class CombinedGroups:
    """Points of several surfaces and shells, their groups and joints in order.

    parts: without morph targets. groups, reach: as of `SkinnedGroups`, of all parts.
    """

    def __init__(self, parts: Sequence[SkinnedGroups | ShellPoints]) -> None:
        self.parts = parts
        self.groups = [group for part in parts for group in part.groups]
        each = [_bound(part) for part in parts]
        self._joints = np.cumsum([0, *(len(one.corners) for one in each)])
        self._firsts = np.cumsum([0, *(len(part.groups) for part in parts)])
        self.reach = [joints + first for part, first in zip(parts, self._joints, strict=False) for joints in part.reach]
        self._old, self._new = (np.concatenate([_nodes(part, i) for part in parts]) for i in (0, 1))
        self._bind, self._new_bind = (np.concatenate([_bind(part, i) for part in parts]) for i in (0, 1))
        products = [product for one in each for product in one.products]
        corners = np.concatenate([one.corners for one in each])
        self._is_same = np.array_equal(self._bind, self._new_bind)
        if self._is_same and not (self._bind == IDENTITY).all():  # in the joints' space, the same in both versions
            corners = matrix.apply(self._bind, corners)
            products = [_in_joints(one, self._bind[joints]) for one, joints in zip(products, self.reach, strict=True)]
        fraction = np.repeat([one.fraction for one in each], np.diff(self._joints))[:, None]
        self._bound = BoundGroups(self.reach, products, corners, fraction)

    @property
    def name(self) -> str:
        """Empty: each group has the name of its surface."""
        return ""

    def field(self, old: PosedSkeleton, new: PosedSkeleton) -> DisplacementField | None:
        """Return the displacement of every point at every time, None without points."""
        if not self.groups or not len(old.pose.times):
            return None
        before, after = old.of(self._old), new.of(self._new)
        if not self._is_same:
            before, after = (
                matrix.multiply(world, bind[:, None]) for world, bind in ((before, self._bind), (after, self._new_bind))
            )
        return SkinnedDisplacement(self._bound, np.subtract(after, before, out=after))

    def weights(self, old: PosedSkeleton, new: PosedSkeleton) -> list[tuple[int, Floats, Floats]]:
        """Return an empty list: the surfaces have no morph targets."""
        del old, new
        return []

    def leader(self, group: int) -> int:
        """Return the index of the node with the largest weight on a group, in the first scene."""
        part, first = self._part(group)
        return part.leader(group - first)

    def node(self, joint: int) -> int:
        """Return the index of the node of a joint, in the first scene."""
        return int(self._old[joint])

    def vertex(self, found: MaxDisplacement) -> int:
        """Return the index in its mesh of the vertex that was found, −1 for none."""
        part, first = self._part(found.group)
        return part.vertex(found._replace(group=found.group - first))

    def is_shell(self, group: int) -> bool:
        """Return whether a group's points are around nodes that move no vertex."""
        part, first = self._part(group)
        return part.is_shell(group - first)

    def name_of(self, found: MaxDisplacement) -> str:
        """Return the name of the surface of what was found; empty for shells."""
        part, first = self._part(found.group)
        return part.name_of(found._replace(group=found.group - first))

    def _part(self, group: int) -> tuple[SkinnedGroups | ShellPoints, int]:
        """The part of a group, and the index of its first group."""
        number = int(np.searchsorted(self._firsts, group, side="right")) - 1
        return self.parts[number], int(self._firsts[number])


def combine_groups(parts: Sequence[PointGroups]) -> list[PointGroups]:
    """Return all parts without morph targets as one, then the others."""
    plain: list[SkinnedGroups | ShellPoints] = []
    others: list[PointGroups] = []
    for part in parts:
        if isinstance(part, ShellPoints) or (isinstance(part, SkinnedGroups) and not len(part.surface.targets)):
            plain.append(part)
        else:
            others.append(part)
    return [*([CombinedGroups(plain)] if plain else []), *others]


def _bound(part: SkinnedGroups | ShellPoints) -> BoundGroups:
    bound = part.bound_groups
    missing = NUM_CORNERS - bound.corners.shape[1]
    if missing <= 0 or not len(bound.corners):
        return replace(bound, corners=bound.corners.reshape(-1, NUM_CORNERS, 3))
    return replace(bound, corners=np.concatenate((bound.corners, bound.corners[:, :missing]), axis=1))


def _nodes(part: SkinnedGroups | ShellPoints, version: int) -> Ints:
    if isinstance(part, ShellPoints):
        return (part.nodes, part.partners)[version]
    return (part.old, part.new)[version].nodes[part.used]


def _bind(part: SkinnedGroups | ShellPoints, version: int) -> Floats:
    if isinstance(part, ShellPoints):
        return np.broadcast_to(IDENTITY, (len(part.nodes), 3, 4))
    return (part.old, part.new)[version].bind[part.used]


def _in_joints(products: Floats, bind: Floats) -> Floats:
    """Products (V, J · 4) of mesh space in the spaces of joints."""
    whole = np.zeros((len(bind), 4, 4))
    whole[:, :3], whole[:, 3, 3] = bind, 1.0
    shaped = products.reshape(len(products), len(bind), 4)
    return np.asarray(np.einsum("vjk,jik->vji", shaped, whole)).reshape(len(products), -1)
