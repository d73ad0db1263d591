"""Rotations as quaternions (..., 4) in the order x, y, z, w, float64.

Every function works on the last axis and broadcasts over the others. Quaternions must be unit unless the docstring
states otherwise; q and −q are the same rotation. A product `multiply(a, b)` rotates by b first, then by a.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import DataRangeError

MIN_ANGLE = 1e-20  # rad, instead of 0 between equal rotations: sines of it and of its parts are these themselves
LARGE = 1 << 20  # components; products of more are summed one by one, which needs a fifth of the memory
SMALL_SINE = 1e-8  # below this |xyz| the angle equals its sine in float64


def multiply(a: Floats, b: Floats) -> Floats:
    """Return the Hamilton product a ⊗ b (..., 4): the rotation b followed by a, both about fixed axes.

    multiply([0, 0, 1, 0], [0, 0, 1, 0]) → [0, 0, 0, −1]
    """
    ax, ay, az, aw = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bx, by, bz, bw = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = aw * bx + ax * bw + ay * bz - az * by
    product[..., 1] = aw * by - ax * bz + ay * bw + az * bx
    product[..., 2] = aw * bz + ax * by - ay * bx + az * bw
    product[..., 3] = aw * bw - ax * bx - ay * by - az * bz
    return product


def conjugate(q: Floats) -> Floats:
    """Return the inverse rotation (..., 4) of unit quaternions: x, y, z negated.

    conjugate([0.6, 0, 0, 0.8]) → [−0.6, 0, 0, 0.8]
    """
    return np.asarray(q * np.array([-1.0, -1.0, -1.0, 1.0]))


def dot(a: Floats, b: Floats) -> Floats:
    """Return the dot product (...) of quaternions (..., 4): the cosine of half the angle, up to sign."""
    if a.size < LARGE:
        return _sum(a * b)
    total = a[..., 0] * b[..., 0]
    for i in range(1, a.shape[-1]):
        total += a[..., i] * b[..., i]
    return np.asarray(total)


def normalize(q: Floats) -> Floats:
    """Return quaternions (..., 4) scaled to unit length, signs kept.

    Raises DataRangeError if one has no length.
    normalize([0, 0, 0, 2]) → [0, 0, 0, 1]
    """
    length = np.sqrt(dot(q, q))[..., None]
    if not (length > 0).all():
        raise DataRangeError("a quaternion of length 0 has no direction (expected a rotation)")
    return np.asarray(q / length)


def slerp(a: Floats, b: Floats, u: Floats | float) -> Floats:
    """Return the spherical linear interpolation (..., 4) from a to b along the shorter arc.

    u: (...), 0 gives a and 1 gives b or −b, exactly; outside 0 … 1 the rotation continues along the same arc.
    The sign of b changes where dot(a, b) < 0, so results are in a's hemisphere. At dot(a, b) = 0 b keeps its sign.
    slerp([0, 0, 0, 1], [0, 0, 1, 0], 0.5) → [0, 0, √½, √½]
    Source: Shoemake 1985; θ ≤ 90° keeps sin θ away from 0 but for equal rotations, where MIN_ANGLE gives 1 − u and u.
    """
    u = np.asarray(u, dtype=np.float64)
    b = _align_sign(a, b)
    theta = np.maximum(2 * np.arctan2(_length(b - a), _length(b + a)), MIN_ANGLE)
    whole = np.sin(theta)
    of_a, of_b = np.sin((1 - u) * theta) / whole, np.sin(u * theta) / whole
    return np.asarray(of_a[..., None] * a + of_b[..., None] * b)


def nlerp(a: Floats, b: Floats, u: Floats | float) -> Floats:
    """Return the normalized linear interpolation (..., 4) from a to b: slerp's arc, not at constant speed.

    u: (...) in 0 … 1. It deviates from slerp by 0.033°, 0.27°, 0.92° for 30°, 60°, 90° between a and b.
    """
    u = np.asarray(u, dtype=np.float64)[..., None]
    return normalize((1 - u) * a + u * _align_sign(a, b))


def rotation_vector(q: Floats) -> Floats:
    """Return axis · angle (..., 3) rad, the angle in 0 … π: a rotation's logarithm (twice that of q).

    Independent of the length of q, and of its sign except at 180°, where the sign selects the axis.
    rotation_vector([0, 0, √½, √½]) → [0, 0, π/2]
    """
    xyz, w = q[..., :3], q[..., 3]
    sine = _length(xyz)
    sign = np.where(w < 0, -1.0, 1.0)
    small = sine <= SMALL_SINE * np.abs(w)
    angle = np.where(small, 2.0, 2 * np.arctan2(sine, np.abs(w)))
    return np.asarray(xyz * (sign * angle / np.where(small, np.maximum(np.abs(w), SMALL_SINE), sine))[..., None])


def from_rotation_vector(vector: Floats) -> Floats:
    """Return unit quaternions (..., 4) of rotations by |vector| rad about `vector` (..., 3).

    from_rotation_vector([0, 0, π]) → [0, 0, 1, 0]
    """
    half = _length(vector)[..., None] / 2
    return np.concatenate((vector * (np.sinc(half / np.pi) / 2), np.cos(half)), axis=-1)


def angle_between(a: Floats, b: Floats) -> Floats:
    """Return the angle (...) rad, 0 … π, between rotations a and b; unlike acos(dot), accurate near 0.

    angle_between([0, 0, 0, 1], [0, 0, 0, −1]) → 0
    """
    chord = np.minimum(_length(a - b), _length(a + b))
    return np.asarray(4 * np.arcsin(np.minimum(chord / 2, 1.0)))


def align_signs(q: Floats, series: Ints | None = None) -> Floats:
    """Return q (K, ..., 4) with signs flipped along the first axis so that neighbors have dot ≥ 0.

    The first key keeps its sign, and so does a key orthogonal to its neighbor. series: (K,) number of the series that
    each key belongs to, of series after each other: each is aligned alone.
    align_signs([[0, 0, 0, 1], [0, 0, 0, −1]]) → [[0, 0, 0, 1], [0, 0, 0, 1]]
    """
    signs = np.ones(q.shape[:-1])
    signs[1:] = np.cumprod(np.where(dot(q[1:], q[:-1]) < 0, -1.0, 1.0), axis=0)
    if series is not None:
        starts = np.flatnonzero(np.diff(series, prepend=-1))
        signs = signs * np.repeat(signs[starts], np.diff(starts, append=len(q)), axis=0)
    return np.asarray(q * signs[..., None])


def rotate(q: Floats, vectors: Floats) -> Floats:
    """Return vectors (..., 3) rotated by unit quaternions (..., 4).

    rotate([0, 0, √½, √½], [1, 0, 0]) → [0, 1, 0]
    """
    axis, w = q[..., :3], q[..., 3:]
    side = 2 * _cross(axis, np.asarray(vectors))
    return np.asarray(vectors + w * side + _cross(axis, side))


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products (..., 3), component by component: np.cross takes twice the time for few and six times for many."""
    found = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.subtract(a[..., j] * b[..., k], a[..., k] * b[..., j], out=found[..., i])
    return found


def to_matrix(q: Floats) -> Floats:
    """Return rotation matrices (..., 3, 3) for column vectors of unit quaternions (..., 4)."""
    x, y, z, w = np.moveaxis(q, -1, 0)
    rows = (
        np.stack((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)), axis=-1),
        np.stack((2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)), axis=-1),
        np.stack((2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)), axis=-1),
    )
    return np.stack(rows, axis=-2)


def from_matrix(matrix: Floats) -> Floats:
    """Return unit quaternions (..., 4) of rotation matrices (..., 3, 3), the largest component positive.

    The matrices must be rotations: no scale, no reflection. Small errors (1e-6) are averaged out.
    Source: Shepperd 1978; the table below is 4 q qᵀ; its row with the largest diagonal is well-conditioned.
    """
    m = np.moveaxis(matrix, (-2, -1), (0, 1))
    xy, xz, yz = m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] + m[1, 2]
    xw, yw, zw = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    xx, yy, zz = m[0, 0], m[1, 1], m[2, 2]
    diagonal = np.stack((1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz), axis=-1)
    table = np.stack(
        (
            np.stack((diagonal[..., 0], xy, xz, xw), axis=-1),
            np.stack((xy, diagonal[..., 1], yz, yw), axis=-1),
            np.stack((xz, yz, diagonal[..., 2], zw), axis=-1),
            np.stack((xw, yw, zw, diagonal[..., 3]), axis=-1),
        ),
        axis=-2,
    )
    row = diagonal.argmax(axis=-1)[..., None, None]
    return normalize(np.take_along_axis(table, row, axis=-2)[..., 0, :])


def derivative(q: Floats, omega: Floats) -> Floats:
    """Return the rate of change (..., 4) of q (..., 4) per second: ½ q ⊗ (omega, 0).

    omega: angular velocity (..., 3) in rad/s about the body's own axes. The result is orthogonal to q.
    derivative([0, 0, 0, 1], [0, 0, 2]) → [0, 0, 1, 0]
    """
    still = np.zeros((*omega.shape[:-1], 1))
    return multiply(q, np.concatenate((omega, still), axis=-1)) / 2


def _align_sign(a: Floats, b: Floats) -> Floats:
    """Return b (..., 4) with the sign of the same hemisphere as a."""
    return np.asarray(b * np.where(dot(a, b) < 0, -1.0, 1.0)[..., None])


def _length(vectors: Floats) -> Floats:
    return np.asarray(np.sqrt(dot(vectors, vectors)))


def _sum(products: Floats) -> Floats:
    """Return the sums (...) over the last axis, three times as fast as numpy's sum over a short axis."""
    total = products[..., 0] + products[..., 1]
    for i in range(2, products.shape[-1]):
        total = total + products[..., i]
    return np.asarray(total)
