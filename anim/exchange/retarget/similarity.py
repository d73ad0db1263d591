"""The similarity transform between two sets of points: rotation and uniform scale, by least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.exchange.euler.motion import IDENTITY
from anim.exchange.retarget.rest_pose import rotation_between
from anim.maths import quaternion

MIN_RANK_FRACTION = 1e-6  # ratio of second to first singular value; below it, points are within a thousandth of a line


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
