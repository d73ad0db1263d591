"""Colors of faces: from materials, else from a muted palette by part, or from a heat map."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.model import VertexCache

DEFAULT_COLOR = (0.60, 0.36, 0.18)
# Linear light: one for each part, repeated cyclically.
PART_COLORS = (
    DEFAULT_COLOR,
    (0.22, 0.33, 0.42),
    (0.48, 0.47, 0.44),
    (0.50, 0.22, 0.15),
    (0.28, 0.36, 0.22),
    (0.62, 0.50, 0.30),
    (0.34, 0.26, 0.38),
)
MIN_BRIGHTNESS = 0.035  # so that shading of black parts stays visible
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


def face_colors(
    cache: VertexCache, materials: Sequence[tuple[float, float, float]] = (), painted: Collection[int] = ()
) -> Floats:
    """Return linear colors (T, 3) of all faces. materials: base colors by index; white counts as none.

    painted: indices of parts with a texture or vertex colors, which keep their base color.
    """
    colors = np.tile(np.array(DEFAULT_COLOR), (len(cache.faces), 1))
    for i, part in enumerate(cache.parts):
        color = materials[part.material] if 0 <= part.material < len(materials) else (1.0, 1.0, 1.0)
        is_plain = min(color) > 0.95 and i not in painted
        darkest = 0.0 if i in painted else MIN_BRIGHTNESS
        colors[slice(*part.faces)] = PART_COLORS[i % len(PART_COLORS)] if is_plain else np.maximum(color, darkest)
    return colors


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
