"""Affine matrices (..., 3, 4) for column vectors: the last row 0 0 0 1 is left out.

Matrices over time (..., F, 3, 4) come as views of (..., 4, 3, F): every component is contiguous over F frames, which
makes sums and products twice as fast.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import hierarchy, quaternion

MIN_AXIS_RATIO = 0.01  # of the longest axis; in float32, directions of shorter axes are dominated by rounding
ORTHOGONALITY_TOLERANCE = 1e-9  # cosine between axes that counts as 0
BLOCK = 65_536  # matrices composed at once, each of about 300 bytes with what comes between


def from_trs(translation: Floats, rotation: Floats, scale: Floats) -> Floats:
    """Return T·R·S (..., 3, 4) from translation (..., 3), unit quaternion xyzw (..., 4), scale (..., 3).

    In float32 if all three are.
    """
    result = _by_component(rotation.shape[:-1], np.result_type(translation, rotation, scale, np.float32))
    count = math.prod(rotation.shape[:-1])
    if count <= BLOCK:
        _compose_trs(translation, rotation, scale, result)
        return result
    step = max(len(rotation) * BLOCK // count, 1)
    for some in (slice(start, start + step) for start in range(0, len(rotation), step)):
        _compose_trs(translation[some], rotation[some], scale[some], result[some])
    return result


def _compose_trs(translation: Floats, rotation: Floats, scale: Floats, result: Floats) -> None:
    """Write T·R·S into `result` (..., 3, 4)."""
    x, y, z, w = np.ascontiguousarray(np.moveaxis(rotation, -1, 0))
    sx, sy, sz = np.ascontiguousarray(np.moveaxis(scale, -1, 0))
    x2, y2, z2 = x + x, y + y, z + z
    xx, yy, zz = x * x2, y * y2, z * z2
    xy, xz, yz = x * y2, x * z2, y * z2
    wx, wy, wz = w * x2, w * y2, w * z2
    np.multiply(1 - (yy + zz), sx, out=result[..., 0, 0])
    np.multiply(xy - wz, sy, out=result[..., 0, 1])
    np.multiply(xz + wy, sz, out=result[..., 0, 2])
    np.multiply(xy + wz, sx, out=result[..., 1, 0])
    np.multiply(1 - (xx + zz), sy, out=result[..., 1, 1])
    np.multiply(yz - wx, sz, out=result[..., 1, 2])
    np.multiply(xz - wy, sx, out=result[..., 2, 0])
    np.multiply(yz + wx, sy, out=result[..., 2, 1])
    np.multiply(1 - (xx + yy), sz, out=result[..., 2, 2])
    result[..., 3] = translation


def multiply(a: Floats, b: Floats) -> Floats:
    """Return the product a·b of affine matrices (..., 3, 4): first b, then a."""
    product: Floats = a[..., :3] @ b
    product[..., 3] += a[..., 3]
    return product


def apply(matrix: Floats, points: Floats) -> Floats:
    """Return points (..., P, 3) transformed by matrices (..., 3, 4)."""
    moved: Floats = points @ np.swapaxes(matrix[..., :3], -1, -2) + matrix[..., None, :, 3]
    return moved


def inverse(matrix: Floats) -> Floats:
    """Return the inverses (..., 3, 4) of affine matrices (..., 3, 4).

    Of a singular matrix, such as a scale of 0, the pseudo-inverse: flattened directions stay flat.
    """
    try:
        back = np.linalg.inv(matrix[..., :3])
    except np.linalg.LinAlgError:
        back = np.linalg.pinv(matrix[..., :3])
    return np.concatenate((back, -(back @ matrix[..., 3:])), axis=-1)


def decompose(matrix: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return translation (..., 3), quaternion (..., 4), scale (..., 3), shear (...) of (..., 3, 4).

    shear: largest error of an axis of the recomposed matrix, as a fraction of the axis length. Where it is 0 the parts
    recompose the matrix; elsewhere they are the nearest rotation with the axes' lengths. Directions of axes shorter
    than MIN_AXIS_RATIO of the longest have less weight: in float32 rounding dominates them. A mirroring matrix gets a
    negative x scale. An axis of length 0 gets scale 0 and a direction orthogonal to the others.
    """
    axes = np.swapaxes(matrix[..., :3], -1, -2)  # rows are the axes
    scale: Floats = np.sqrt((axes * axes).sum(axis=-1))
    floor = MIN_AXIS_RATIO * scale.max(axis=-1, keepdims=True)
    directions = axes / np.where(scale > 0, scale, 1)[..., None]
    if not scale.all():
        directions = _complete_axes(directions, scale)
    cosines = directions @ np.swapaxes(directions, -1, -2)
    skewed = (np.abs(cosines * (1 - np.eye(3))) > ORTHOGONALITY_TOLERANCE).any()
    lengths = scale + floor
    mirror = np.where(np.linalg.det(directions) < 0, -1.0, 1.0)
    scale[..., 0] *= mirror
    directions[..., 0, :] *= mirror[..., None]
    if skewed:
        counted = np.minimum(np.abs(scale), floor) / np.where(floor > 0, floor, 1)
        directions = _nearest_rotation(directions * (counted * counted)[..., None])
    misses = np.linalg.norm(axes - scale[..., None] * directions, axis=-1)
    shear: Floats = (misses / np.where(lengths > 0, lengths, 1)).max(axis=-1)
    return matrix[..., 3].copy(), quaternion.from_matrix(np.swapaxes(directions, -1, -2)), scale, shear


def accumulate_world(local: Floats, parents: Ints, levels: list[Ints], *, in_place: bool = False) -> Floats:
    """Return world matrices (N, F, 3, 4) from local ones: one batched product per level of the hierarchy, or fewer.

    parents: (N,), −1 for roots. levels: node indices by depth, roots first. in_place: whether they replace the local
    ones.
    """
    columns = np.swapaxes(local, 1, 3)
    world = hierarchy.accumulate(columns, parents, levels, _multiply_columns, out=columns if in_place else None)
    return np.swapaxes(world, 1, 3)


def accumulate_from_tops(local: Floats, parents: Ints, levels: list[Ints]) -> Floats:
    """Return the products (N, 3, 4) of matrices on the path from each node's top to it.

    parents: (N,), −1 for tops. local: (N, 3, 4), the identity for tops that are not roots of the hierarchy. levels: of
    the whole hierarchy, as of `accumulate_world`.
    """
    above = np.where(parents < 0, np.arange(len(parents)), parents)  # of a top its own identity
    return accumulate_world(local[:, None].copy(), above, levels, in_place=True)[:, 0]


def _multiply_columns(above: Floats, own: Floats) -> Floats:
    """Products of matrices given as (..., 4, 3, F), the same in both ways; of one frame `einsum` takes longer."""
    product: Floats
    if own.shape[-1] == 1:
        product = above[:, None, 0] * own[:, :, 0, None]
        product += above[:, None, 1] * own[:, :, 1, None]
        product += above[:, None, 2] * own[:, :, 2, None]
    else:
        product = np.einsum("njif,nkjf->nkif", above[:, :3], own)
    product[:, 3] += above[:, 3]
    return product


def _by_component(shape: tuple[int, ...], kind: np.dtype[Any]) -> Floats:
    """An empty array (*shape, 3, 4), contiguous over the last axis of `shape`."""
    if not shape:
        return np.empty((3, 4), kind)
    return np.swapaxes(np.empty((*shape[:-1], 4, 3, shape[-1]), kind), -1, -3)


def _complete_axes(directions: Floats, scale: Floats) -> Floats:
    """Directions (..., 3, 3) in rows, those of zero length replaced so that all three are orthogonal."""
    flat, lengths = directions.reshape(-1, 3, 3).copy(), scale.reshape(-1, 3)
    for n in np.flatnonzero((lengths == 0).any(axis=1)):
        for i in np.flatnonzero(lengths[n] == 0).tolist():
            normal = np.cross(flat[n, (i + 1) % 3], flat[n, (i + 2) % 3])
            length = np.linalg.norm(normal)
            flat[n, i] = normal / length if length > 0 else _orthogonalize(flat[n], i)
    return flat.reshape(directions.shape)


def _orthogonalize(rows: Floats, missing: int) -> Floats:
    """Unit vector orthogonal to the other rows."""
    there = [row for i, row in enumerate(rows) if i != missing and row.any()]
    if not there:
        return np.asarray(np.eye(3)[missing])
    axis = np.eye(3)[np.argmin(np.abs(there[0]))]
    normal = np.cross(there[0], axis)
    return np.asarray(normal / np.linalg.norm(normal))


def _nearest_rotation(matrix: Floats) -> Floats:
    """Rotations nearest to matrices (..., 3, 3), singular ones included."""
    u, _, v = np.linalg.svd(matrix)
    u[..., 2] *= np.where(np.linalg.det(u @ v) < 0, -1.0, 1.0)[..., None]
    nearest: Floats = u @ v
    return nearest
