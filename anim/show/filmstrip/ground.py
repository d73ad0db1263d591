"""Ground height of a motion: below the feet, ignoring held props."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray, Bools, Floats
from anim.model import VertexCache

FOOT_FRACTION = 0.05  # of the rest pose's height; vertices below this are feet, wheels, hems
FLOOR_FRACTION = 0.05  # of the height; feet within this distance of 0 are on the floor of the scene


def ground_height(cache: VertexCache, body: Bools | None = None) -> float:
    """Return the ground height in m of a motion: the lowest position of its feet, 0 if that is near.

    Feet are the lowest vertices of the rest pose, or of the first frame without one: this needs no names, and a sword
    that points at the ground is excluded.
    body: (V,) vertices that can be feet: the skinned ones, if props are separate meshes.
    """
    rest = cache.rest if cache.rest is not None else next(iter(cache.chunks())).positions[0]
    chosen = np.ones(len(rest), bool) if body is None or not body.any() else body
    feet = _feet(rest, chosen)
    lowest = min(float(chunk.positions[:, feet, 1].min()) for chunk in cache.chunks())
    height = float(np.ptp(rest[chosen, 1]))
    return 0.0 if abs(lowest) <= FLOOR_FRACTION * height else lowest


def _feet(rest: Floats | AnyArray, body: Bools) -> Bools:
    heights = rest[:, 1]
    low, high = float(heights[body].min()), float(heights[body].max())
    return np.asarray(body & (heights <= low + FOOT_FRACTION * (high - low)))
