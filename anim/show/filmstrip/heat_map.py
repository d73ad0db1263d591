"""Heat map of distances: light gray at 0, yellow, red, dark violet at the greatest."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray, Floats, Ints

# Linear light at even steps from 0 to 1.
STOPS = np.array(
    [
        (0.62, 0.63, 0.65),
        (0.80, 0.64, 0.25),
        (0.85, 0.33, 0.07),
        (0.62, 0.07, 0.06),
        (0.28, 0.02, 0.12),
        (0.09, 0.01, 0.13),
    ]
)


def colors(shares: Floats) -> Floats:
    """Return linear colors (..., 3) of fractions (...) from 0 to 1."""
    place = np.clip(shares, 0, 1) * (len(STOPS) - 1)
    low = np.minimum(place.astype(np.int64), len(STOPS) - 2)
    part = (place - low)[..., None]
    found: Floats = STOPS[low] * (1 - part) + STOPS[low + 1] * part
    return found


def heat_colors(distances: AnyArray, faces: Ints, most: float) -> Floats:
    """Return colors (T, 3) of faces from distances (V,) at their corners, scaled to the greatest, `most`."""
    return colors(distances[faces].mean(axis=1) / most if most > 0 else np.zeros(len(faces)))


def distances(positions: AnyArray, others: AnyArray) -> Floats:
    """Return the distances (..., V) in m between vertices (..., V, 3) and others."""
    found: Floats = np.linalg.norm(positions.astype(np.float64) - others, axis=-1)
    return found
