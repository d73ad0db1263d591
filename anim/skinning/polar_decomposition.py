"""Polar decomposition of skinning matrices: rigid motion for methods that only rotate, and stretch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.skinning.binding import SkinBinding

RIGID_TOLERANCE = 2e-6  # of AᵀA from 1, or from a multiple of it: rounding of float32 bind matrices


@dataclass(frozen=True, slots=True)
class PolarDecomposition:
    """Joints' matrices as rotation (n, J, 4) xyzw and translation (n, J, 3), after a stretch and a scale.

    scale_shear: (n, J, 3, 4), scale: (n, J); None if all are rigid.
    """

    rotation: Floats
    translation: Floats
    scale_shear: Floats | None = None
    scale: Floats | None = None


def decompose(matrices: Floats, pivots: Floats) -> PolarDecomposition:
    """Return affine matrices (n, J, 3, 4) as A p + t = R (S p + c o) + t′ − c R o, for any c.

    The factor R is a rotation, o the joint's own position in bind space, `pivots` (J, 3), and t′ its transformed
    position. S is a symmetric stretch about o; a mirrored joint has all three factors negative. `scale` is the joint's
    own, ∛det A. A blend takes one c for all joints of a vertex (`weighted_joints.scale_fractions`). If they all scale
    equally, that is their scale: the blend is then the one without scale, enlarged. A joint that alone grows or shears
    does so about its own position, and doesn't move vertices that it shares with its neighbors. decompose(2 · identity
    about (0, 1, 0)) → S p = 2 p − (0, 2, 0), c = 2, t′ = (0, 1, 0) Source: polar decomposition, Shoemake & Duff 1992.
    """
    linear = matrices[..., :3]
    if _is_rotation(linear).all():
        return PolarDecomposition(quaternion.from_matrix(linear), matrices[..., 3])
    return _decompose_sheared(matrices, pivots)


def decompose_after(matrices: Floats, pivots: Floats, shape: Floats) -> PolarDecomposition:
    """Return the decomposition of matrices (n, J, 3, 4) after a common stretch `shape` (3, 3).

    pivots: (J, 3) m, stretched by it.
    """
    bound = np.concatenate((matrices[..., :3] @ np.linalg.inv(shape), matrices[..., 3:]), axis=-1)
    parts = _decompose_sheared(bound, pivots)
    assert parts.scale_shear is not None
    whole = np.concatenate((parts.scale_shear[..., :3] @ shape, parts.scale_shear[..., 3:]), axis=-1)
    return replace(parts, scale_shear=whole)


def joint_origins(rig: SkinBinding) -> Floats:
    """Return the position of each joint (J, 3) in mesh space at bind time; the origin if undefined."""
    linear = rig.bind[..., :3]
    singular = np.abs(np.linalg.det(linear)) == 0
    if singular.any():
        linear = np.where(singular[:, None, None], np.eye(3), linear)
    found = np.linalg.solve(linear, -rig.bind[..., 3:])[..., 0]
    found[singular] = 0
    return np.asarray(found, np.float64)


def _is_rotation(linear: Floats) -> Bools:
    """Return whether matrices (..., 3, 3) have no scale, shear or mirror; false for NaN."""
    x, y, z = np.ascontiguousarray(np.moveaxis(linear, (-1, -2), (0, 1)))  # by component: rows are fast
    unit = [_dot(each, each) - 1 for each in (x, y, z)]
    square = np.stack([*unit, _dot(x, y), _dot(y, z), _dot(z, x)])
    normal = (x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0])
    return np.asarray((np.abs(square).max(axis=0) < RIGID_TOLERANCE) & (_dot(normal, z) > 0))


def _dot(a: Sequence[Floats], b: Sequence[Floats]) -> Floats:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _decompose_sheared(matrices: Floats, pivots: Floats) -> PolarDecomposition:
    linear, moved = matrices[..., :3], matrices[..., 3]
    rotation, stretch = _polar(linear, np.swapaxes(linear, -1, -2) @ linear)
    whole = np.concatenate((stretch, -_times(stretch, pivots)[..., None]), axis=-1)
    scale = np.cbrt(np.linalg.det(linear))
    return PolarDecomposition(quaternion.from_matrix(rotation), _times(linear, pivots) + moved, whole, scale)


def _polar(linear: Floats, square: Floats) -> tuple[Floats, Floats]:
    """Rotation and stretch (..., 3, 3); an SVD only for matrices that are no scaled rotation."""
    size = np.sqrt(np.trace(square, axis1=-2, axis2=-1) / 3)[..., None, None]
    sign = np.where(np.linalg.det(linear) < 0, -1.0, 1.0)[..., None, None]
    even = (np.abs(square - size**2 * np.eye(3)).max(axis=(-1, -2)) <= RIGID_TOLERANCE * size[..., 0, 0] ** 2) & (
        size[..., 0, 0] > 0
    )
    rotation = sign * linear / np.where(size > 0, size, 1)
    stretch = sign * size * np.eye(3)
    if not even.all():
        u, factors, v = np.linalg.svd(linear[~even])
        flip = np.where(np.linalg.det(u @ v) < 0, -1.0, 1.0)[:, None, None]
        rotation[~even] = flip * (u @ v)
        stretch[~even] = flip * (np.swapaxes(v, -1, -2) @ (factors[:, :, None] * v))
    return rotation, stretch


def _times(matrices: Floats, vectors: Floats) -> Floats:
    return np.asarray((matrices @ vectors[..., None])[..., 0])
