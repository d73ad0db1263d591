"""Rigid motions as dual quaternions (..., 8): rotation x, y, z, w, then dual part x, y, z, w, float64."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion


def from_rigid(rotation: Floats, translation: Floats) -> Floats:
    """Return the dual quaternions (..., 8) of rotations (..., 4), unit, followed by translations (..., 3).

    from_rigid([0, 0, 0, 1], [2, 0, 0]) → [0, 0, 0, 1, 1, 0, 0, 0]
    Source: Kavan et al. 2008, "Geometric Skinning with Approximate Dual Quaternion Blending", equation 4.
    """
    moved = np.concatenate((translation / 2, np.zeros((*translation.shape[:-1], 1))), axis=-1)
    return np.concatenate((rotation, quaternion.multiply(moved, rotation)), axis=-1)


def apply(dual: Floats, points: Floats) -> Floats:
    """Return points (..., 3) transformed by dual quaternions (..., 8), normalized first; none may be 0.

    apply([0, 0, 0, 1, 1, 0, 0, 0], [5, 5, 5]) → [7, 5, 5]
    """
    length = np.sqrt((dual[..., :4] ** 2).sum(axis=-1, keepdims=True))
    turn, shift = dual[..., :4] / length, dual[..., 4:] / length
    axis, w = turn[..., :3], turn[..., 3:]
    moved = 2 * (w * shift[..., :3] - shift[..., 3:] * axis + np.cross(axis, shift[..., :3]))
    return np.asarray(quaternion.rotate(turn, points) + moved)
