"""Skinning matrices taken apart into a rigid motion and a stretch, so that methods that only turn can use them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import quaternion
from anim.skinning.compiled import compiled
from anim.skinning.kernels.rigid_turns import rigid_turns
from anim.skinning.rig import Rig

RIGID = 2e-6  # how far AᵀA may be from 1, or from a multiple of it: what float32 bind matrices leave behind


@dataclass(frozen=True, slots=True)
class Split:
    """Joints' matrices as stretch first, then rotation (n, J, 4) xyzw and translation (n, J, 3).

    stretch: (n, J, 3, 4), None where all are rigid and there is nothing to stretch.
    """

    rotation: Floats
    translation: Floats
    stretch: Floats | None


def split(matrices: Floats, pivots: Floats, top: int = 0) -> Split:
    """Return affine matrices (n, J, 3, 4) as A p + t = R (S p) + t′ with R a rotation.

    S is symmetric, about the joint's own place `pivots` (J, 3), so that a joint that grows or shears doesn't drag what
    it shares with its neighbors; a mirrored joint has all three factors negative. The scale of joint `top`, and
    whether it is mirrored, is taken to be common to all (units, a scaled root) and lies about the origin.
    Source: polar decomposition, Shoemake & Duff 1992.
    """
    linear, moved = matrices[..., :3], matrices[..., 3]
    turns: Floats = np.empty((*matrices.shape[:2], 4))
    if compiled(rigid_turns)(matrices, RIGID, turns):
        return Split(turns, moved, None)
    common = np.cbrt(np.linalg.det(linear[:, top]))
    common = np.where(common != 0, common, 1.0)[:, None]
    square = np.swapaxes(linear, -1, -2) @ linear
    scaled = linear / common[..., None, None]
    turn, stretch = _polar(scaled, square / common[..., None, None] ** 2)
    centers = common[..., None] * pivots
    offset = centers - _times(stretch, centers)
    translation = _times(scaled - turn, centers) + moved
    whole = np.concatenate((stretch * common[..., None, None], offset[..., None]), axis=-1)
    return Split(quaternion.from_matrix(turn), translation, whole)


def pivots(rig: Rig) -> Floats:
    """Return where each joint (J, 3) stands in mesh space at bind time; the origin for one that has no such place."""
    linear = rig.bind[..., :3]
    solvable = np.abs(np.linalg.det(linear)) > 0
    found = np.zeros((len(linear), 3))
    found[solvable] = -np.linalg.solve(linear[solvable], rig.bind[solvable][..., 3:])[..., 0]
    return found


def topmost(above: Ints) -> int:
    """Return the first joint that hangs on no other."""
    return int(np.argmax(above < 0))


def _polar(linear: Floats, square: Floats) -> tuple[Floats, Floats]:
    """Rotation and stretch (..., 3, 3); the slow way only for matrices that are no rotation times a number."""
    size = np.sqrt(np.trace(square, axis1=-2, axis2=-1) / 3)[..., None, None]
    sign = np.where(np.linalg.det(linear) < 0, -1.0, 1.0)[..., None, None]
    even = (np.abs(square - size**2 * np.eye(3)).max(axis=(-1, -2)) <= RIGID * size[..., 0, 0] ** 2) & (
        size[..., 0, 0] > 0
    )
    turn = sign * linear / np.where(size > 0, size, 1)
    stretch = sign * size * np.eye(3)
    if not even.all():
        u, factors, v = np.linalg.svd(linear[~even])
        flip = np.where(np.linalg.det(u @ v) < 0, -1.0, 1.0)[:, None, None]
        turn[~even] = flip * (u @ v)
        stretch[~even] = flip * (np.swapaxes(v, -1, -2) @ (factors[:, :, None] * v))
    return turn, stretch


def _times(matrices: Floats, vectors: Floats) -> Floats:
    return np.asarray((matrices @ vectors[..., None])[..., 0])
