"""How far points are from the joints that carry them: what turns a bound on joints into one on a surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.measure.error.point_groups import Binding, PointGroups, SkinnedGroups
from anim.measure.error.shell_points import ShellPoints


@dataclass(frozen=True, slots=True)
class Morphing:
    """How morph weights move points of one surface.

    owners: the nodes whose weights count in both versions. rest: (2, M) weights where no track moves them.
    targets: (J, M) m, no point that a joint carries is moved farther in the joint's space by a weight of 1.
    """

    owners: tuple[int, int]
    rest: Floats
    targets: Floats


@dataclass(frozen=True, slots=True)
class InfluenceRadius:
    """What J joints carry of one surface.

    nodes: (J,). arms: (J,) m, no point that a joint carries is farther from it, in its own space; of a morphed surface
    without any weight. apart: (J,) m, no point's two versions are farther apart there. share: (J,), the largest sum of
    skin weights of a vertex. groups: joints that carry some of each group of points.
    """

    nodes: Ints
    arms: Floats
    apart: Floats
    fraction: Floats
    groups: Sequence[Ints]
    morphing: Morphing | None = None


def influence_radius(part: PointGroups) -> InfluenceRadius | None:
    """Return what carries a surface, None where other nodes do so in the second version."""
    if isinstance(part, ShellPoints):
        arms = np.sqrt((part.points * part.points).sum(axis=-1)).max(axis=-1, initial=0.0)
        same = np.array_equal(part.nodes, part.partners)
        return InfluenceRadius(part.nodes, arms, np.zeros_like(arms), np.ones_like(arms), part.reach) if same else None
    if not isinstance(part, SkinnedGroups) or not np.array_equal(part.old.nodes[part.used], part.new.nodes[part.used]):
        return None
    if (part.old.nodes[part.used] < 0).any():
        return None
    surface, nodes = part.surface, part.old.nodes[part.used]
    arms = _arms(part, surface.points, part.old.bind, 1.0)
    apart = _arms(part, surface.points, part.new.bind - part.old.bind, 1.0)
    morphing = _morphing(part, part.old, part.new) if len(surface.targets) else None
    return InfluenceRadius(nodes, arms, apart, np.full(len(nodes), part.fraction), part.reach, morphing)


def join_reaches(reaches: Sequence[InfluenceRadius]) -> InfluenceRadius:
    """Return several surfaces that are not morphed as one, their groups in order."""
    firsts = np.cumsum([0, *(len(each.nodes) for each in reaches)])
    groups = [joints + first for each, first in zip(reaches, firsts[:-1], strict=True) for joints in each.groups]
    return InfluenceRadius(
        np.concatenate([each.nodes for each in reaches]),
        np.concatenate([each.arms for each in reaches]),
        np.concatenate([each.apart for each in reaches]),
        np.concatenate([each.fraction for each in reaches]),
        groups,
    )


def _morphing(part: SkinnedGroups, old: Binding, new: Binding) -> Morphing:
    targets = np.array([_arms(part, target, old.bind, 0.0) for target in part.surface.targets])
    return Morphing((old.owner, new.owner), np.array([old.rest_weights, new.rest_weights]), targets.T)


def _arms(part: SkinnedGroups, points: Floats, bind: Floats, one: float) -> Floats:
    """The longest of the vectors (V, 3) that each used joint carries (J,), in the joint's space by `bind` (J, 3, 4).

    one: 1 for points, 0 for what has no place.
    """
    result = np.zeros(len(part.used))
    for joints, weights in zip(part.surface.joints.T, part.surface.weights.T, strict=True):
        carried: Bools = np.asarray(weights > 0)
        matrices = bind[joints[carried]]
        moved = np.einsum("vij,vj->vi", matrices[..., :3], points[carried]) + one * matrices[..., 3]
        place = np.searchsorted(part.used, joints[carried])
        np.maximum.at(result, place, np.sqrt((moved * moved).sum(axis=1)))
    return result
