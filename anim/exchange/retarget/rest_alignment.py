"""Alignment of two rest poses as wholes: heading, size, and the level of the floor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from anim.arrays import Floats, Ints
from anim.exchange.retarget.joint_matching import JointMatch
from anim.exchange.retarget.rest_pose import RestPose, facing_rotation
from anim.exchange.retarget.similarity import fit_similarity

ALIKE = 1e-3  # of the radius; joints that differ less between two rest poses are those of one build
MAX_SCALE_RATIO = 0.5  # share of the source's joints that must be matched for them to tell the figure's size
HANGING = 0.1  # of the size, that the lowest joint must be below 0 for a rest pose to hang from its origin


class Measure(StrEnum):
    """What the scale of lengths is taken from."""

    BUILD = "build"
    LEGS = "legs"
    JOINTS = "matched joints"
    EXTENT = "extent"


@dataclass(frozen=True, slots=True)
class RestAlignment:
    """target_from_source: rotation (4,) and scale of lengths, from one rest pose to the other."""

    rotation: Floats
    scale: float
    measure: Measure

    @property
    def alike(self) -> bool:
        """Whether that takes all matched joints to their places: the build is the same, and nothing else differs."""
        return self.measure is Measure.BUILD


def align_rests(source: RestPose, target: RestPose, matching: JointMatch, *, of_one_tree: bool) -> RestAlignment:
    """Return how the target's rest pose lies to the source's.

    Of one build (moved, turned, scaled as a whole): exactly so. Otherwise a turn about the vertical, see `facing`, and
    the length of the legs. Where these are not matched, how far the matched joints lie around their middle; where
    they are few, the largest extents of both figures.
    of_one_tree: whether nodes are matched because names and parents agree, see `same_tree`. Joints on a line, or a
    single one, are of one build with any other such: there it decides.
    """
    pairs = np.array([*matching.pairs.items()], np.int64)
    found = fit_similarity(source.positions[pairs[:, 0]], target.positions[pairs[:, 1]])
    if found.error <= ALIKE and (found.unique or of_one_tree):
        return RestAlignment(found.rotation, found.scale, Measure.BUILD)
    one, other = _legs(source, matching.source_roles), _legs(target, matching.target_roles)
    measure = Measure.LEGS
    if not one > 0 or not other > 0:
        most = len(pairs) > 1 and len(pairs) >= MAX_SCALE_RATIO * (len(pairs) + len(matching.unmatched))
        measure = Measure.JOINTS if most else Measure.EXTENT
    if measure is Measure.JOINTS:
        one, other = _spread(source.positions[pairs[:, 0]]), _spread(target.positions[pairs[:, 1]])
    elif measure is Measure.EXTENT:
        one, other = _extent(source, pairs[:, 0]), _extent(target, pairs[:, 1])
    return RestAlignment(facing_rotation(source, target, matching), (other or 1.0) / (one or 1.0), measure)


def with_offset(source: Floats, target: Floats, heights: Floats, node: int) -> float:
    """Return by how much the source's rest pose must go up to stand on the floor, in metres: 0 where it stands.

    A BVH's root mostly rests at the origin, its feet below; only the motion lifts it. That is so where the source
    hangs, the target does not, and the motion is nearer to standing.
    source, target: positions (N, 3) at rest. heights: (F,) of the source's `node`, which carries the path.
    """
    hanging = _hangs(source)
    if not hanging or _hangs(target):
        return 0.0
    above_rest = float(np.median(heights)) - float(source[node, 1])
    return hanging if 2 * above_rest > hanging else 0.0


def _hangs(positions: Floats) -> float:
    """How far the lowest node is below 0; 0 where that is little."""
    lowest = -float(positions[:, 1].min())
    return lowest if lowest > HANGING * float(np.ptp(positions, axis=0).max()) else 0.0


def _legs(pose: RestPose, roles: Mapping[str, int]) -> float:
    """Mean length of the legs whose joints are all known, 0 where none is."""
    legs = []
    for side in ("left", "right"):
        joints = [roles.get(f"{side}_{role}") for role in ("upper_leg", "lower_leg", "foot")]
        if all(joint is not None for joint in joints):
            places = pose.positions[np.array(joints, np.int64)]
            legs.append(float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum()))
    return float(np.mean(legs)) if legs else 0.0


def _spread(places: Floats) -> float:
    """How far places (P, 3) lie around their middle."""
    return float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _extent(pose: RestPose, nodes: Ints) -> float:
    """The longest side of the box around the trees of nodes (P,): a person's height, also where arms are spread."""
    roots = {_root(pose, node) for node in nodes.tolist()}
    figure = [node for node in range(len(pose.positions)) if _root(pose, node) in roots]
    return float(np.ptp(pose.positions[figure], axis=0).max())


def _root(pose: RestPose, node: int) -> int:
    while pose.parents[node] >= 0:
        node = pose.parents[node]
    return node
