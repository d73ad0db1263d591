"""Surface patterns that show stretch and twist: a checker fixed to the rest pose, and edges of faces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from anim.arrays import AnyArray, Floats, Ints

CELLS = 10.0  # squares of a checker along the diagonal of the rest pose
DARK, LIGHT = 0.38, 1.12  # brightness of the squares
EDGE, EDGE_WIDTH = 0.30, 1.1  # brightness of edges, and their width in pixels
FINE, COARSE = 3.0, 9.0  # pixels of triangle size: edges fade in from the first to the second
MIN_EDGE_DARKNESS = 0.12  # of the full darkness: edges of the smallest triangles

# (corners (S, 3, 3) on the screen, x and y of samples (S, 2), their faces (S,)) → brightness (S,)
SurfaceMarks = Callable[[Floats, Floats, Ints], Floats]


def checker(rest: AnyArray, faces: Ints) -> SurfaceMarks:
    """Return a checker of cubes in the rest pose, dark and light alternately, deformed with the surface.

    rest: (V, 3) m. faces: (T, 3). It needs no texture coordinates: lines straight at rest show the bending.
    """
    used = rest[np.unique(faces)].astype(np.float64)
    low, high = used.min(axis=0), used.max(axis=0)
    cell = max(float(np.linalg.norm(high - low)) / CELLS, 1e-12)

    def brightness(corners: Floats, samples: Floats, chosen: Ints) -> Floats:
        shares = barycentric(corners, samples) * corners[:, :, 2]  # on the screen → in space
        shares /= shares.sum(axis=1, keepdims=True)
        places = np.einsum("si,sic->sc", shares, rest[faces[chosen]].astype(np.float64))
        odd = np.floor((places - (low + high) / 2) / cell).astype(np.int64).sum(axis=1) % 2 == 1
        return np.where(odd, DARK, LIGHT)

    return brightness


def edges(corners: Floats, samples: Floats, faces: Ints) -> Floats:
    """Return the brightness (S,) at samples (S, 2) in pixels, dark near edges of faces.

    Dense edges are fainter, so that the surface stays visible.
    """
    heights = _heights(corners)
    is_near = (barycentric(corners, samples) * heights).min(axis=1) < EDGE_WIDTH / 2
    depth = np.interp(heights.min(axis=1), (FINE, COARSE), (MIN_EDGE_DARKNESS, 1.0))
    return np.where(is_near, 1 - (1 - EDGE) * depth, 1.0)


def barycentric(corners: Floats, samples: Floats) -> Floats:
    """Return the barycentric weights (S, 3) on the screen of corners (S, 3, ≥ 2) at samples (S, 2)."""
    a, b, c = (corners[:, i, :2] for i in range(3))
    area = _cross(b - a, c - a)
    two, three = _cross(samples - a, c - a) / area, _cross(b - a, samples - a) / area
    return np.stack((1 - two - three, two, three), axis=1)


def _heights(corners: Floats) -> Floats:
    """Heights (S, 3) in pixels over the edge opposite each corner; times the weight its distance."""
    flat = corners[..., :2]
    area = np.abs(_cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]))
    opposite = np.linalg.norm(flat[:, [2, 0, 1]] - flat[:, [1, 2, 0]], axis=2)
    return np.asarray(area[:, None] / np.maximum(opposite, 1e-12))


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
