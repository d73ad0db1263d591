"""Height of the ground under a motion: under the feet, not under what hands hold."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray, Bools, Floats
from anim.model import VertexCache

FOOT_FRACTION = 0.05  # of the height at rest; vertices that rest lower than this are feet, wheels, hems
FLOOR_FRACTION = 0.05  # of the height; feet that lift or sink less than this stand at 0, the floor of the scene


def ground_height(cache: VertexCache, body: Bools | None = None) -> float:
    """Return the height in m of the ground of a motion: the lowest place of its feet, 0 where that is near.

    Feet are the vertices that are lowest in the rest pose, in the first frame where there is none: they need no names,
    and a sword that is pointed at the ground is none of them.
    body: (V,) vertices that can be feet; those that a skin moves, where props are meshes of their own.
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
