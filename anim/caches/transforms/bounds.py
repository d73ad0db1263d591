"""Bounding box of the motion in a cache."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.model import VertexCache


def bounds(cache: VertexCache) -> tuple[Floats, Floats]:
    """Return the minimum and maximum x, y, z (3,) of all vertices of all frames; 0 without vertices.

    The cache is read in one pass.
    """
    least, most = np.full(3, np.inf), np.full(3, -np.inf)
    for chunk in cache.chunks():
        least = np.minimum(least, chunk.positions.min(axis=(0, 1), initial=np.inf))
        most = np.maximum(most, chunk.positions.max(axis=(0, 1), initial=-np.inf))
    return (least, most) if (least <= most).all() else (np.zeros(3), np.zeros(3))


def diagonal(cache: VertexCache) -> float:
    """Return the diagonal of the bounding box of the whole motion, in metres."""
    least, most = bounds(cache)
    return float(np.linalg.norm(most - least))
