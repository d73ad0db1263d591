"""Playback of stored keys: slerp, nlerp, linear interpolation, world matrices; rotations unit or not.

Keys and values of many tracks are (C, T, ·): component, track, then key or time. left, u: (T, W), the key at or before
each time, which another one follows unless there is only one, and the interpolation parameter between the two.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import hierarchy, matrix, quaternion
from anim.model import Skeleton
from anim.sampling.track import MAX_MIXED_VALUES
from anim.sampling.world import local_matrices

MIN_ANGLE = 1e-9  # rad; at this angle the weights of slerp are those of linear interpolation, in float64


def slerp_raw(keys: Floats, left: Ints, u: Floats) -> Floats:
    """Return slerp (4, T, W) between stored quaternions (4, T, K), not normalized, as in three.js."""
    if keys.shape[2] == 1:
        return np.repeat(keys, left.shape[1], axis=2)
    a, b = keys[..., :-1], keys[..., 1:]
    b = np.where(dot(a, b) < 0, -b, b)
    angle = np.maximum(2 * np.arctan2(_length(b - a), _length(b + a)), MIN_ANGLE)  # (T, K - 1)
    ends = np.concatenate((a, b)) / np.sin(angle)
    shown = np.empty((4, *left.shape))
    count = max(MAX_MIXED_VALUES // max(4 * len(left), 1), 1)
    for first in range(0, left.shape[1], count):
        some = slice(first, first + count)
        theta, parameter = _take(angle[None], left[:, some])[0], u[:, some]
        near = _take(ends, left[:, some])
        near[:4] *= np.sin((1 - parameter) * theta)
        near[4:] *= np.sin(parameter * theta)
        np.add(near[:4], near[4:], out=shown[..., some])
    return shown


def nlerp(keys: Floats, left: Ints, u: Floats) -> Floats:
    """Return nlerp (4, T, W) between quaternions (4, T, K), as in Unity's glTFast."""
    a, b = _ends(keys, left)
    b = np.where(dot(a, b) < 0, -b, b)
    return normalize((1 - u) * a + u * b)


def lerp(keys: Floats, left: Ints, u: Floats) -> Floats:
    """Return linear interpolation (C, T, W) between vectors (C, T, K)."""
    a, b = _ends(keys, left)
    return np.asarray((1 - u) * a + u * b)


def arc_distance(angle: Floats) -> Floats:
    """Return the largest angle in radians between slerp and nlerp, for keys `angle` (...) rad apart.

    The cubic is within 4 % up to 90°, where the two are 0.92° apart.
    """
    return np.asarray(angle**3 / 241)


def steps(keys: Floats) -> Floats:
    """Return the angles (K - 1, ...) in radians between neighboring rotations (K, ..., 4)."""
    return quaternion.angle_between(keys[:-1], keys[1:])


def dot(a: Floats, b: Floats) -> Floats:
    """Return the dot products (...) of quaternions (4, ...)."""
    total = a[0] * b[0]
    for i in range(1, len(a)):
        total += a[i] * b[i]
    return np.asarray(total)


def normalize(keys: Floats) -> Floats:
    """Return quaternions (4, ...) scaled to unit length."""
    return np.asarray(keys / _length(keys))


def required_levels(skeleton: Skeleton, nodes: Ints) -> tuple[Ints, ...]:
    """Return the nodes of each depth, roots first, that are in `nodes` or above one of them."""
    needed = np.zeros(len(skeleton), np.bool_)
    for node in nodes.tolist():
        while node >= 0 and not needed[node]:
            needed[node] = True
            node = int(skeleton.parents[node])
    return hierarchy.filter_levels(skeleton.levels(), needed)


def level_world_matrices(skeleton: Skeleton, local: Sequence[Floats], levels: Sequence[Ints]) -> Floats:
    """Return world matrices (N, F, 3, 4) from translation, rotation and scale (N, F, ·), not normalized.

    Matrices of nodes outside `levels` are undefined.
    """
    return matrix.accumulate_world(local_matrices(skeleton, local), skeleton.parents, list(levels))


def _ends(keys: Floats, left: Ints) -> tuple[Floats, Floats]:
    """The keys (C, T, W) at the two ends of each interval."""
    return _take(keys, left), _take(keys, np.minimum(left + 1, keys.shape[2] - 1))


def _take(keys: Floats, index: Ints) -> Floats:
    """The keys (C, T, W) of tracks (C, T, K) by index (T, W)."""
    flat = index + keys.shape[2] * np.arange(len(index))[:, None]
    found: Floats = np.take(keys.reshape(len(keys), -1), flat, axis=1)
    return found


def _length(vectors: Floats) -> Floats:
    return np.asarray(np.sqrt(dot(vectors, vectors)))
