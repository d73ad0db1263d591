"""How players show keys: along arcs or along chords, with rotations as they are stored, unit or not."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.sampling.track import KeyInterval


def slerp_raw(keys: Floats, place: KeyInterval) -> Floats:
    """Return slerp (W, G, 4) between stored quaternions (K, G, 4), not normalized: what three.js shows."""
    here = np.arange(len(keys) - 1)
    a, b = keys[here], keys[here + 1]
    b = np.where(quaternion.dot(a, b)[..., None] < 0, -b, b)
    theta = 2 * np.arctan2(_length(b - a), _length(b + a))  # (K - 1, G)
    left = np.minimum(place.left, max(len(keys) - 2, 0))
    u = np.where(place.left == left, place.u, 1.0)[:, None]
    theta = theta[left]
    whole = np.sinc(theta / np.pi)
    of_a = (1 - u) * np.sinc((1 - u) * theta / np.pi) / whole
    of_b = u * np.sinc(u * theta / np.pi) / whole
    return np.asarray(of_a[..., None] * a[left] + of_b[..., None] * b[left])


def nlerp(keys: Floats, place: KeyInterval) -> Floats:
    """Return the normalized mix (W, G, 4) of quaternions (K, G, 4) by components: what Unity's glTFast shows."""
    a, b = keys[place.left], keys[place.right]
    b = np.where(quaternion.dot(a, b)[..., None] < 0, -b, b)
    return quaternion.normalize(a + place.u[:, None, None] * (b - a))


def linear_error(keys: Floats, place: KeyInterval) -> Floats:
    """Return the mix (W, G, C) of vectors (K, G, C)."""
    a = keys[place.left]
    return np.asarray(a + place.u[:, None, None] * (keys[place.right] - a))


def arc_distance(angle: Floats) -> Floats:
    """Return how far, in radians of turn, chord and arc are from each other at most, for keys `angle` (...) rad apart.

    The cubic is within 4 % up to 90°, where the two are 0.92° apart.
    """
    return np.asarray(angle**3 / 241)


def steps(keys: Floats) -> Floats:
    """Return the angles (K - 1, ...) in radians of the turns from key to key of rotations (K, ..., 4)."""
    return quaternion.angle_between(keys[:-1], keys[1:])


def _length(vectors: Floats) -> Floats:
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=-1)))
