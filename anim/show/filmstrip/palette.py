"""Colors of faces: from materials, otherwise from a muted palette by part."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from anim.arrays import Floats
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
