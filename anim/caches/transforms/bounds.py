"""How large the motion in a cache is."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.model import VertexCache


def bounds(cache: VertexCache) -> tuple[Floats, Floats]:
    """Return the least and the greatest x, y, z (3,) of all vertices of all frames, in one pass; 0 without vertices."""
    least, most = np.full(3, np.inf), np.full(3, -np.inf)
    for chunk in cache.chunks():
        least = np.minimum(least, chunk.positions.min(axis=(0, 1), initial=np.inf))
        most = np.maximum(most, chunk.positions.max(axis=(0, 1), initial=-np.inf))
    return (least, most) if (least <= most).all() else (np.zeros(3), np.zeros(3))


def diagonal(cache: VertexCache) -> float:
    """Return the length of the diagonal of the box around the whole motion, in metres."""
    least, most = bounds(cache)
    return float(np.linalg.norm(most - least))
