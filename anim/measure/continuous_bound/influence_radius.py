"""Influence radius of joints: distance of the points with influence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.measure.error.combined_groups import CombinedGroups
from anim.measure.error.point_groups import Binding, PointGroups, SkinnedGroups
from anim.measure.error.shell_points import ShellPoints

BLOCK = 65_536  # points per step, each about 200 bytes


class Morphing(NamedTuple):
    """Displacement of one surface's points by morph weights.

    owners: the nodes with the weights in both versions. rest: (2, M) weights without a track.
    targets: (J, M) m, bound of the displacement in each joint's space at weight 1.
    """

    owners: tuple[int, int]
    rest: Floats
    targets: Floats


class InfluenceRadius(NamedTuple):
    """Bounds of the points of one surface by J joints.

    nodes: (J,). arms: (J,) m, largest distance of a point with influence from the joint in its own space; of a morphed
    surface at weights 0. apart: (J,) m, largest difference there between both versions. fraction: (J,), the largest sum
    of skin weights of a vertex. groups: joints with influence on each group of points.
    """

    nodes: Ints
    arms: Floats
    apart: Floats
    fraction: Floats
    groups: Sequence[Ints]
    morphing: Morphing | None = None


def influence_radius(part: PointGroups) -> InfluenceRadius | None:
    """Return the influence radius of a surface's joints; None if the second version has other joints."""
    if isinstance(part, CombinedGroups):
        each = [influence_radius(one) for one in part.parts if len(one.groups)]
        known = [one for one in each if one is not None]
        return join_reaches(known) if known and len(known) == len(each) else None
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
    is_same = part.new is part.old
    apart = np.zeros_like(arms) if is_same else _arms(part, surface.points, part.new.bind - part.old.bind, 1.0)
    morphing = _morphing(part, part.old, part.new) if len(surface.targets) else None
    return InfluenceRadius(nodes, arms, apart, np.full(len(nodes), part.fraction), part.reach, morphing)


def join_reaches(reaches: Sequence[InfluenceRadius]) -> InfluenceRadius:
    """Return several surfaces without morph targets as one, their groups in order."""
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
    if part.surface.is_rigid:  # of thousands of nodes with one mesh, in one call for all targets
        targets = _longest_directions(part.surface.targets, old.bind[0, :, :3])[:, None]
    else:
        targets = np.array([_arms(part, target, old.bind, 0.0) for target in part.surface.targets])
    return Morphing((old.owner, new.owner), np.array([old.rest_weights, new.rest_weights]), targets.T)


def _longest_directions(targets: Floats, linear: Floats) -> Floats:
    """The longest direction (M,) of each target (M, V, 3), in the space to which a matrix (3, 3) leads."""
    is_same, size = bool((linear == np.eye(3)).all()), max(BLOCK // max(len(targets), 1), 1)
    squares = np.zeros(len(targets))
    for start in range(0, targets.shape[1], size):
        some = targets[:, start : start + size]
        moved = some if is_same else np.einsum("ij,mvj->mvi", linear, some)
        np.maximum(squares, (moved * moved).sum(axis=2).max(axis=1), out=squares)
    return np.asarray(np.sqrt(squares))


def _arms(part: SkinnedGroups, points: Floats, bind: Floats, one: float) -> Floats:
    """The longest vector per used joint (J,), in the joint's space by `bind` (J, 3, 4).

    points: (V, 3), or (V, I, 3) with those of each influence. one: 1 for points, 0 for directions.
    """
    result = np.zeros(len(part.used))
    influences = list(zip(part.surface.joints.T, part.surface.weights.T, strict=True))
    for some in (slice(start, start + BLOCK) for start in range(0, len(points), BLOCK)):
        for i, (joints, weights) in enumerate(influences):
            own = points[some] if points.ndim == 2 else points[some, i]
            carried: Bools = np.asarray(weights[some] > 0)
            chosen = joints[some][carried]
            matrices = bind[chosen]
            moved = np.einsum("vij,vj->vi", matrices[..., :3], own[carried]) + one * matrices[..., 3]
            np.maximum.at(result, np.searchsorted(part.used, chosen), np.sqrt((moved * moved).sum(axis=1)))
    return result
