"""Rotations of matrices that only turn and move, in float64."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats


def rigid_turns(matrices: Floats, tolerance: float, turns: Floats) -> bool:
    """Write the rotations (n, J, 4) xyzw of matrices (n, J, 3, 4); False, with some left out, unless all are rigid.

    tolerance: how far products of columns may be from those of a rotation. The largest component is positive.
    """
    for f in range(len(matrices)):
        for j in range(matrices.shape[1]):
            if not is_rigid(matrices[f, j], tolerance):
                return False
            set_turn(turns[f, j], matrices[f, j])
    return True


def is_rigid(m: Floats, tolerance: float) -> bool:
    """Return whether m (3, 4) has no scale, shear or mirror; one that holds NaN has."""
    for i in range(3):
        for k in range(i, 3):
            product = m[0, i] * m[0, k] + m[1, i] * m[1, k] + m[2, i] * m[2, k]
            if not abs(product - (1 if i == k else 0)) < tolerance:
                return False
    x = m[1, 0] * m[2, 1] - m[2, 0] * m[1, 1]
    y = m[2, 0] * m[0, 1] - m[0, 0] * m[2, 1]
    z = m[0, 0] * m[1, 1] - m[1, 0] * m[0, 1]
    return bool(x * m[0, 2] + y * m[1, 2] + z * m[2, 2] > 0)


def set_turn(q: Floats, m: Floats) -> None:
    """Set q (4,) to the rotation of m (3, 4).

    Source: Shepperd 1978: the largest of 4 q² is divided by, so that no digits are lost.
    """
    xx, yy, zz = m[0, 0], m[1, 1], m[2, 2]
    x, y, z, w = 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz
    most = max(x, y, z, w)
    if x == most:
        y, z, w = m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]
    elif y == most:
        x, z, w = m[1, 0] + m[0, 1], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]
    elif z == most:
        x, y, w = m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[1, 0] - m[0, 1]
    else:
        x, y, z = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    length = np.sqrt(x * x + y * y + z * z + w * w)
    q[0], q[1], q[2], q[3] = x / length, y / length, z / length, w / length
