"""Alignment of two whole rest poses: similarity, heading, size, and floor level."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from anim.arrays import Floats, Ints
from anim.exchange.euler.motion import IDENTITY
from anim.exchange.retarget.joint_matching import JointMatch
from anim.exchange.retarget.rest_pose import RestPose, facing_rotation, rotation_between
from anim.maths import quaternion
from anim.model.skeleton import ancestors

BUILD_TOLERANCE = 1e-3  # fraction of the radius; joints that differ less between two rest poses have the same build
MIN_MATCHED_FRACTION = 0.5  # minimum fraction of the source's joints that must be matched to measure the size
MIN_HANGING_FRACTION = 0.1  # of the size; minimum depth of the lowest joint below 0 for a hanging rest pose
MIN_RANK_FRACTION = 1e-6  # ratio of second to first singular value; below it, points are within a thousandth of a line


class Measure(StrEnum):
    """Source of the scale of lengths."""

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
        """True for equal builds: the alignment maps all matched joints to their positions."""
        return self.measure is Measure.BUILD


def align_rests(source: RestPose, target: RestPose, matching: JointMatch, *, of_one_tree: bool) -> RestAlignment:
    """Return the alignment of the source's rest pose to the target's.

    For equal builds (up to a similarity transform) it is exact. Otherwise a rotation about the vertical, see
    `facing_rotation`, and the ratio of leg lengths. Without matched legs, the spread of the matched joints around their
    mean; with few matches, the largest extents of both skeletons.
    of_one_tree: True if nodes are matched by equal names and parents, see `match_same_hierarchy`. Collinear joints, or
    a single one, always fit: there it decides.
    """
    pairs = np.array([*matching.pairs.items()], np.int64)
    found = fit_similarity(source.positions[pairs[:, 0]], target.positions[pairs[:, 1]])
    if found.error <= BUILD_TOLERANCE and (found.unique or of_one_tree):
        return RestAlignment(found.rotation, found.scale, Measure.BUILD)
    one, other = _leg_length(source, matching.source_roles), _leg_length(target, matching.target_roles)
    measure = Measure.LEGS
    if not one > 0 or not other > 0:
        most = len(pairs) > 1 and len(pairs) >= MIN_MATCHED_FRACTION * (len(pairs) + len(matching.unmatched))
        measure = Measure.JOINTS if most else Measure.EXTENT
    if measure is Measure.JOINTS:
        one, other = _spread(source.positions[pairs[:, 0]]), _spread(target.positions[pairs[:, 1]])
    elif measure is Measure.EXTENT:
        one, other = _extent(source, pairs[:, 0]), _extent(target, pairs[:, 1])
    return RestAlignment(facing_rotation(source, target, matching), (other or 1.0) / (one or 1.0), measure)


def floor_offset(source: Floats, target: Floats, heights: Floats, node: int) -> float:
    """Return the upward offset of the source's rest pose to the floor, in metres: 0 if it is there.

    A BVH's root mostly rests at the origin with its feet below; only the motion lifts it. That is detected if the
    source hangs, the target does not, and the motion is nearer to standing.
    source, target: positions (N, 3) at rest. heights: (F,) of the source's `node`, which carries the path.
    """
    hanging = _depth_below_floor(source)
    if not hanging or _depth_below_floor(target):
        return 0.0
    above_rest = float(np.median(heights)) - float(source[node, 1])
    return hanging if 2 * above_rest > hanging else 0.0


def _depth_below_floor(positions: Floats) -> float:
    """Depth of the lowest node below 0; 0 if small."""
    lowest = -float(positions[:, 1].min())
    return lowest if lowest > MIN_HANGING_FRACTION * float(np.ptp(positions, axis=0).max()) else 0.0


def _leg_length(pose: RestPose, roles: Mapping[str, int]) -> float:
    """Mean length of the completely matched legs, 0 without any."""
    legs = []
    for side in ("left", "right"):
        joints = [roles.get(f"{side}_{role}") for role in ("upper_leg", "lower_leg", "foot")]
        if all(joint is not None for joint in joints):
            places = pose.positions[np.array(joints, np.int64)]
            legs.append(float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum()))
    return float(np.mean(legs)) if legs else 0.0


def _spread(places: Floats) -> float:
    """Spread of positions (P, 3) around their mean."""
    return float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _extent(pose: RestPose, nodes: Ints) -> float:
    """Longest side of the bounding box of the trees of nodes (P,): a person's height, also in T-pose."""
    roots = {_root(pose, node) for node in nodes.tolist()}
    figure = [node for node in range(len(pose.positions)) if _root(pose, node) in roots]
    return float(np.ptp(pose.positions[figure], axis=0).max())


def _root(pose: RestPose, node: int) -> int:
    return [node, *ancestors(pose.parents, node)][-1]


@dataclass(frozen=True, slots=True)
class Similarity:
    """target ≈ scale · rotation · source + offset. rotation: unit quaternion (4,).

    error: largest residual distance, divided by the radius of the target's points. unique: False for collinear or
    coincident points, for which other rotations give the same result.
    """

    rotation: Floats
    scale: float
    error: float
    unique: bool


def fit_similarity(source: Floats, target: Floats) -> Similarity:
    """Return the best transform of points (P, 3) to others (P, 3); of several, the smallest rotation.

    For collinear points the rotation about the line is 0, for coincident points every rotation, and the scale is 1. The
    error is infinite if only one set is coincident. A reflection is no similarity: its error is large.
    (points, the same twice as large and rotated by 90° about y) → rotation (0, 0.707, 0, 0.707), scale 2, error 0
    Source: S. Umeyama, Least-squares estimation of transformation parameters between two point patterns, 1991.
    """
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    radii = [float(np.linalg.norm(points, axis=1).max(initial=0.0)) for points in (a, b)]
    if not min(radii) > 0:
        return Similarity(IDENTITY, 1.0, 0.0 if max(radii) == 0 else np.inf, False)
    u, s, vt = np.linalg.svd(b.T @ a)
    unique = bool(s[1] > MIN_RANK_FRACTION * s[0])
    signs = np.array((1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt)))) if unique else np.array((1.0, 0, 0))
    rotation = quaternion.from_matrix((u * signs) @ vt) if unique else rotation_between(vt[0], u[:, 0])
    scale = float((s * signs).sum() / (a * a).sum())
    error = np.linalg.norm(b - scale * quaternion.rotate(rotation, a), axis=1).max()
    return Similarity(rotation, scale, float(error) / radii[1], unique)
