"""Euler angles ↔ quaternions (x, y, z, w) in radians, for all 12 orders, intrinsic and extrinsic.

An order lists axes as they are written: intrinsic ZXY is R = Z(a)·X(b)·Y(c), about the axes of the rotating body;
extrinsic ZXY is R = Y(c)·X(b)·Z(a), about fixed axes, Z first. Angles (..., 3) are in the order's own sequence.
FBX and Maya call extrinsic XYZ "XYZ"; three.js and BVH list intrinsic axes.

Internally every order is decomposed as the proper order nearest to it: angles first, middle (0 … π), third, with gimbal
lock at middle = 0 and π. There only third + first, or third − first, is determined.
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from anim.arrays import Bools, Floats
from anim.errors import RangeError
from anim.maths import quaternion

ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "XYX", "XZX", "YXY", "YZY", "ZXZ", "ZYZ")
GIMBAL_TOLERANCE_RAD = 5e-8  # rad from lock, below which float64 can't separate first and third angle
TAU = 2 * np.pi


class AxesConvention(StrEnum):
    """Axes of the elementary rotations: of the body (intrinsic) or fixed (extrinsic)."""

    INTRINSIC = "intrinsic"
    EXTRINSIC = "extrinsic"


def to_quaternion(angles: Floats, *, order: str, frame: AxesConvention = AxesConvention.INTRINSIC) -> Floats:
    """Return unit quaternions (..., 4) of angles (..., A) in radians about the A axes of `order`.

    order: any sequence of X, Y, Z, as long as the last axis of `angles`; "" gives the identity.
    to_quaternion([0, 0, π/2], order="XYZ") → [0, 0, √½, √½]
    """
    result: Floats = np.zeros((*angles.shape[:-1], 4))
    result[..., 3] = 1.0
    for i, axis in enumerate(order):
        turn = np.zeros_like(result)
        turn[..., "XYZ".index(axis)] = np.sin(angles[..., i] / 2)
        turn[..., 3] = np.cos(angles[..., i] / 2)
        if i == 0:
            result = turn
        else:
            result = quaternion.multiply(*((result, turn) if frame == AxesConvention.INTRINSIC else (turn, result)))
    return result


def from_quaternion(q: Floats, *, order: str, frame: AxesConvention = AxesConvention.INTRINSIC) -> Floats:
    """Return angles (..., 3) in radians of unit quaternions (..., 4), each independently.

    The middle angle is in −π/2 … π/2, of proper orders (first axis = third) in 0 … π; the others in −π … π.
    At lock the sum or difference is split evenly between first and third angle.
    from_quaternion([0, 0, √½, √½], order="XYZ") → [0, 0, π/2]
    Raises RangeError for an unknown order. Source: Bernardes & Viollet 2022.
    """
    a, b, c, d = _parts(q, order, frame)
    middle, half_sum, half_difference, near, far = _extract_angles(a, b, c, d, GIMBAL_TOLERANCE_RAD)
    half_difference = np.where(near, 0.0, half_difference)
    half_sum = np.where(far, 0.0, half_sum)
    raw = np.stack((half_sum - half_difference, middle, half_sum + half_difference), axis=-1)
    angles = _complete_triple(raw, order, frame)
    angles[..., 0::2] = wrap_angles(angles[..., 0::2])
    return angles


def unwrap(
    q: Floats, *, order: str, frame: AxesConvention = AxesConvention.INTRINSIC, lock: float = GIMBAL_TOLERANCE_RAD
) -> Floats:
    """Return continuous angles (K, ..., 3) in radians of unit quaternions (K, ..., 4).

    Each key gets the equivalent triple (both families, any multiples of 2π) nearest to that of the key before; the
    first gets that of `from_quaternion`. Keys at lock keep the determined sum or difference of first and third angle
    exactly; the undetermined one is interpolated between the neighbors on both sides.
    lock: rad from lock below which the undetermined angle is ignored; rotations keep this accuracy. Give the precision
    of the data: 5e-8 for float64, 1e-6 for float32 of a file.
    Raises RangeError for an unknown order.
    """
    if len(q) == 0:
        return np.zeros((*q.shape[:-1], 3))
    flat = q.reshape(len(q), -1, 4)
    a, b, c, d = _parts(flat, order, frame)
    middle, half_sum, half_difference, near, far = _extract_angles(a, b, c, d, lock)
    raw = np.stack((wrap_angles(half_sum - half_difference), middle, wrap_angles(half_sum + half_difference)), axis=-1)
    locked = near | far
    free = ~locked.any(axis=0)
    raw[:, free] = _unwrap_triples(raw[:, free])
    for i in np.flatnonzero(~free).tolist():
        raw[:, i] = _interpolate_in_lock(raw[:, i], half_sum[:, i], half_difference[:, i], near[:, i], far[:, i])
    return _complete_triple(raw, order, frame).reshape(*q.shape[:-1], 3)


def gimbal_distance(q: Floats, *, order: str) -> Floats:
    """Return the angle (...) rad, 0 … π/2, of unit quaternions (..., 4) from an intrinsic order's lock.

    The extrinsic order with the axes reversed has the same distance.
    gimbal_distance([0, 0, 0, 1], order="XYZ") → π/2
    """
    a, b, c, d = _parts(q, order, AxesConvention.INTRINSIC)
    first, second = np.hypot(a, b), np.hypot(c, d)
    return np.asarray(2 * np.arctan2(np.minimum(first, second), np.maximum(first, second)))


def gimbal_cosine(q: Floats, *, order: str) -> Floats:
    """Return the cosine (...) of `gimbal_distance`, in a tenth of its time; 1 at lock.

    gimbal_cosine([0, 0, 0, 1], order="XYZ") → 0
    """
    a, b, c, d = _parts(q, order, AxesConvention.INTRINSIC)
    first, second = a * a + b * b, c * c + d * d
    return np.asarray(np.abs(first - second) / (first + second))


def is_proper(order: str) -> bool:
    """Return whether the first axis equals the third, as in ZXZ."""
    return order[0] == order[2]


def check_order(order: str) -> str:
    """Return the order in capitals. Raises RangeError unless it is one of the twelve."""
    if order.upper() not in ORDERS:
        raise RangeError(f"`order` is '{order}' (expected one of {', '.join(ORDERS)})")
    return order.upper()


def wrap_angles(angles: Floats) -> Floats:
    """Return angles shifted by multiples of 2π into −π … π; those inside are unchanged."""
    return np.asarray(angles - TAU * np.rint(angles / TAU))


def _axes(order: str, frame: AxesConvention) -> tuple[int, int, int, float]:
    """First, second and remaining axis of the extrinsic sequence; 1 if right-handed, −1 if left-handed."""
    listed = check_order(order) if frame == AxesConvention.EXTRINSIC else check_order(order)[::-1]
    i, j, k = ("XYZ".index(axis) for axis in listed)
    if i == k:
        k = 3 - i - j
    return i, j, k, (i - j) * (j - k) * (k - i) / 2


def _parts(q: Floats, order: str, frame: AxesConvention) -> tuple[Floats, Floats, Floats, Floats]:
    """Complex a + ib and c + id: lengths give the middle angle, directions half sum and half difference."""
    i, j, k, sign = _axes(order, frame)
    x, y, z, w = q[..., i], q[..., j], q[..., k] * sign, q[..., 3]
    if is_proper(order):
        return w, x, y, z
    return w - y, x + z, y + w, z - x


def _extract_angles(
    a: Floats, b: Floats, c: Floats, d: Floats, lock: float
) -> tuple[Floats, Floats, Floats, Bools, Bools]:
    first, second = np.hypot(a, b), np.hypot(c, d)
    middle = 2 * np.arctan2(second, first)
    return middle, np.arctan2(b, a), np.arctan2(d, c), middle <= lock, np.pi - middle <= lock


def _complete_triple(raw: Floats, order: str, frame: AxesConvention) -> Floats:
    """Angles of the order itself, in its own sequence, from those of the proper order."""
    sign = _axes(order, frame)[3]
    angles = raw.copy()
    if not is_proper(order):
        angles[..., 1] -= np.pi / 2
        angles[..., 2] *= sign
    return angles if frame == AxesConvention.EXTRINSIC else angles[..., ::-1].copy()


def _unwrap_triples(raw: Floats) -> Floats:
    """Triples (K, ..., 3), each the equivalent one nearest to its predecessor.

    The other family is (first + π, −middle, third + π). Distances between two keys are equal in both families, so a
    change of family doesn't depend on the current family, and families are a running sum of changes. One angle after
    the other: all three of a million keys take three times the memory.
    """
    same, changed = np.zeros((2, len(raw) - 1, *raw.shape[1:-1]))
    for axis in range(3):
        angle, other = raw[..., axis], _of_other_family(raw, axis)
        same += wrap_angles(angle[1:] - angle[:-1]) ** 2
        changed += wrap_angles(other[1:] - angle[:-1]) ** 2
    is_other = np.zeros(raw.shape[:-1], np.bool_)
    is_other[1:] = np.cumsum(changed < same - 1e-12, axis=0) % 2
    found = np.empty_like(raw)
    for axis in range(3):
        found[..., axis] = np.unwrap(np.where(is_other, _of_other_family(raw, axis), raw[..., axis]), axis=0)
    return found


def _of_other_family(raw: Floats, axis: int) -> Floats:
    """One angle (K, ...) of the other family of triples (K, ..., 3)."""
    return np.asarray(-raw[..., 1] if axis == 1 else raw[..., axis] + np.pi)


def _interpolate_in_lock(raw: Floats, half_sum: Floats, half_difference: Floats, near: Bools, far: Bools) -> Floats:
    """Triples (K, 3) of one curve; keys at lock are interpolated between the others."""
    keys = np.arange(len(raw))
    free = keys[~(near | far)]
    if len(free):
        unwound = _unwrap_triples(raw[free])
        about = np.stack([np.interp(keys, free, unwound[:, axis]) for axis in range(3)], axis=-1)
    else:
        unwound, about = raw[:0], np.zeros_like(raw)
        about[:, 1] = np.where(near, 0.0, np.pi)
    total, difference = about[:, 2] + about[:, 0], about[:, 2] - about[:, 0]
    total = np.where(near, _nearest(2 * half_sum, total, len(free) > 0), total)
    difference = np.where(far, _nearest(2 * half_difference, difference, len(free) > 0), difference)
    base = np.where(near, 0.0, np.pi)
    middle = base + TAU * np.rint((about[:, 1] - base) / TAU)
    filled = np.stack(((total - difference) / 2, middle, (total + difference) / 2), axis=-1)
    filled[free] = unwound
    return filled


def _nearest(angle: Floats, goal: Floats, has_goal: bool) -> Floats:
    """`angle` (K,) shifted by multiples of 2π nearest to `goal`, or to its predecessor without a goal."""
    return angle + TAU * np.rint((goal - angle) / TAU) if has_goal else np.asarray(np.unwrap(wrap_angles(angle)))
