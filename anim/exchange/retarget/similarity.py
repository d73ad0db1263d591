"""The similarity transform between two sets of points: rotation and uniform scale, by least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.exchange.euler.motion import IDENTITY
from anim.exchange.retarget.rest_pose import rotation_between
from anim.maths import quaternion

MIN_RANK_FRACTION = 1e-6  # second singular value by the first; below it, points are within a thousandth of a line


@dataclass(frozen=True, slots=True)
class Similarity:
    """target ≈ scale · rotation · source + offset. rotation: unit quaternion (4,). error: largest distance left over,
    by the radius of the target's points. unique: False where points lie on a line or in one place, which other
    rotations take to the same places.
    """

    rotation: Floats
    scale: float
    error: float
    unique: bool


def fit_similarity(source: Floats, target: Floats) -> Similarity:
    """Return the transform that takes points (P, 3) to others (P, 3) best; of several, the one that turns least.

    Points on a line leave the turn about it open, points in one place every turn, and the scale: 1 then. The error is
    infinite where one set is in one place and the other is not. Mirroring is no similarity: its error is large.
    (a figure, the same twice as large and turned by 90° about y) → rotation (0, 0.707, 0, 0.707), scale 2, error 0
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
