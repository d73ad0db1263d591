"""Playback of stored keys: slerp, nlerp, linear interpolation, world matrices; rotations unit or not."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix, quaternion
from anim.model import Skeleton
from anim.sampling.track import MAX_MIXED_VALUES, KeyInterval
from anim.sampling.world import local_matrices

EPSILON = np.finfo(np.float64).eps


def slerp_raw(keys: Floats, place: KeyInterval) -> Floats:
    """Return slerp (W, G, 4) between stored quaternions (K, G, 4), not normalized, as in three.js."""
    a, b = keys[:-1], keys[1:]
    b = np.where(quaternion.dot(a, b)[..., None] < 0, -b, b)
    theta = 2 * np.arctan2(_length(b - a), _length(b + a))  # (K - 1, G)
    left = np.minimum(place.left, max(len(keys) - 2, 0))
    u = np.where(place.left == left, place.u, 1.0)[:, None]
    shown = np.empty((len(u), *keys.shape[1:]))
    count = max(MAX_MIXED_VALUES // max(math.prod(keys.shape[1:]), 1), 1)
    for first in range(0, len(shown), count):
        some = slice(first, first + count)
        shown[some] = _slerp(a, b, theta, left[some], u[some])
    return shown


def _slerp(a: Floats, b: Floats, theta: Floats, left: Ints, u: Floats) -> Floats:
    """Slerp (F, G, 4) between keys `left` (F,) of a and b (K, G, 4), `theta` (K, G) rad apart, at u (F, 1)."""
    angle = theta[left]
    whole = _sine_ratio(angle)
    of_a = (1 - u) * _sine_ratio((1 - u) * angle) / whole
    of_b = u * _sine_ratio(u * angle) / whole
    return np.asarray(of_a[..., None] * a[left] + of_b[..., None] * b[left])


def nlerp(keys: Floats, place: KeyInterval) -> Floats:
    """Return nlerp (W, G, 4) between quaternions (K, G, 4), as in Unity's glTFast."""
    a, b = keys[place.left], keys[place.right]
    b = np.where(quaternion.dot(a, b)[..., None] < 0, -b, b)
    return quaternion.normalize(a + place.u[:, None, None] * (b - a))


def linear_error(keys: Floats, place: KeyInterval) -> Floats:
    """Return linear interpolation (W, G, C) between vectors (K, G, C)."""
    a = keys[place.left]
    return np.asarray(a + place.u[:, None, None] * (keys[place.right] - a))


def arc_distance(angle: Floats) -> Floats:
    """Return the largest angle in radians between slerp and nlerp, for keys `angle` (...) rad apart.

    The cubic is within 4 % up to 90°, where the two are 0.92° apart.
    """
    return np.asarray(angle**3 / 241)


def steps(keys: Floats) -> Floats:
    """Return the angles (K - 1, ...) in radians between neighboring rotations (K, ..., 4)."""
    return quaternion.angle_between(keys[:-1], keys[1:])


def required_levels(skeleton: Skeleton, nodes: Ints) -> tuple[Ints, ...]:
    """Return the nodes of each depth, roots first, that are in `nodes` or above one of them."""
    needed = np.zeros(len(skeleton), np.bool_)
    for node in nodes.tolist():
        while node >= 0 and not needed[node]:
            needed[node] = True
            node = int(skeleton.parents[node])
    return tuple(level[needed[level]] for level in skeleton.levels())


def level_world_matrices(skeleton: Skeleton, local: Sequence[Floats], levels: Sequence[Ints]) -> Floats:
    """Return world matrices (N, F, 3, 4) from translation, rotation and scale (N, F, ·), not normalized.

    Matrices of nodes outside `levels` are undefined.
    """
    return matrix.accumulate_world(local_matrices(skeleton, local), skeleton.parents, list(levels))


def _sine_ratio(angle: Floats) -> Floats:
    """sin(angle) / angle, as np.sinc computes it, without its overhead per call."""
    scaled = np.pi * (angle / np.pi)
    divisor = np.where(scaled, scaled, EPSILON)
    return np.asarray(np.sin(divisor) / divisor)


def _length(vectors: Floats) -> Floats:
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=-1)))
