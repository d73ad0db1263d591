"""Add keys for many joints at once until slerp and lerp follow a motion within a tolerance."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats, Ints
from anim.exchange.euler import adaptive_keys
from anim.exchange.euler.adaptive_keys import MAX_ANGLE_RAD, MAX_SUBDIVISIONS, SAFETY_FACTOR
from anim.maths import quaternion

SAMPLES = np.arange(1, 8) / 8

Motion: TypeAlias = Callable[[Floats], tuple[dict[int, Floats], Floats]]


def refine_linear(times: Floats, motion: Motion, *, tolerance: float, size: float) -> Floats:
    """Return key times, including `times`, with slerp and lerp within the tolerance of the motion.

    times: (K,) s, float32-exact. motion: at times (F,) → unit quaternions (F, 4) by node, and paths (F, P, 3), m.
    tolerance: rad for each rotation; the error of paths is at most tolerance × size. No joint rotates by more than 120°
    in a segment.
    Raises RangeError for over two million keys.
    """
    return adaptive_keys.refine_keys(times, lambda a, b: _intervals_to_split(motion, a, b, tolerance, size))


def _intervals_to_split(motion: Motion, a: Floats, b: Floats, tolerance: float, size: float) -> Ints:
    """Segment count (B,) to split each segment into; 1 for none."""
    shares = np.concatenate(([0.0], SAMPLES, [1.0]))
    at = a[:, None] + (b - a)[:, None] * shares
    at[:, -1] = b
    rotations, paths = motion(at.ravel())
    places = paths.reshape(*at.shape, *paths.shape[1:])
    chord = places[:, :1] + (places[:, -1:] - places[:, :1]) * SAMPLES[None, :, None, None]
    error = np.linalg.norm(chord - places[:, 1:-1], axis=-1).max(axis=(1, 2), initial=0.0) / size
    turns = np.ones(len(a))
    for flat in rotations.values():
        q = flat.reshape(*at.shape, 4)
        straight = quaternion.slerp(q[:, :1], q[:, -1:], SAMPLES[None])
        error = np.maximum(error, quaternion.angle_between(straight, q[:, 1:-1]).max(axis=1))
        turned = quaternion.angle_between(q[:, 1:], q[:, :-1]).sum(axis=1)
        turns = np.maximum(turns, np.ceil(turned / MAX_ANGLE_RAD - 1e-4))
    bent = np.ceil(np.sqrt(error * SAFETY_FACTOR / tolerance) - 1e-9)
    pieces: Ints = np.clip(np.maximum(turns, bent), 1, MAX_SUBDIVISIONS).astype(np.int64)
    return pieces
