"""Perspective camera framed on a whole motion in three-quarter view."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from anim.arrays import AnyArray, Floats

AZIMUTH, ELEVATION = 35.0, 14.0  # degrees: from the front (+Z) toward +X, and from above
FIELD_OF_VIEW_DEG = 24.0  # degrees, vertical field of view: a long focal length keeps proportions
MARGIN_FRACTION = 0.06  # share of the picture that stays free on each side
MIN_ASPECT, MAX_ASPECT = 0.62, 1.78  # width by height of a picture
MIN_DEPTH_M = 1e-6  # m
BLOCK = 250_000  # points that are turned at once


@dataclass(frozen=True, slots=True)
class Camera:
    """Camera. eye: (3,) m. axes: rows right, up, back (3, 3). scale: pixels for a slope of 1.

    width, height: of the picture in pixels.
    """

    eye: Floats
    axes: Floats
    scale: float
    width: int
    height: int

    def project(self, points: Floats) -> Floats:
        """Return x and y in pixels and nearness (1 / distance) of points (..., 3)."""
        seen = (points - self.eye) @ self.axes.T
        near = 1 / np.maximum(-seen[..., 2], MIN_DEPTH_M)
        x = self.width / 2 + self.scale * seen[..., 0] * near
        y = self.height / 2 - self.scale * seen[..., 1] * near
        return np.stack((x, y, near), axis=-1)

    def rays(self, rows: slice = slice(None)) -> Floats:
        """Return the direction (height, width, 3) of the ray through each pixel of some rows, not normalized."""
        x = (np.arange(self.width) + 0.5 - self.width / 2) / self.scale
        y = (self.height / 2 - np.arange(self.height)[rows] - 0.5) / self.scale
        right, up, back = self.axes
        rays: Floats = x[None, :, None] * right + y[:, None, None] * up - back
        return rays


def fit_camera(points: AnyArray, *, height: int, azimuth: float = AZIMUTH, elevation: float = ELEVATION) -> Camera:
    """Return the camera framed on points (P, 3), with the aspect ratio of their projection.

    azimuth, elevation: degrees of the eye around the motion, from +Z toward +X, and above the horizon.
    """
    axes = _axes(math.radians(azimuth), math.radians(elevation))
    points = points.reshape(-1, 3) if points.size else np.zeros((1, 3))
    blocks = np.array_split(points, len(points) // BLOCK + 1)
    most = np.max([_turn(each, axes).max(axis=0) for each in blocks], axis=0)
    least = np.min([_turn(each, axes).min(axis=0) for each in blocks], axis=0)
    middle = (most + least) / 2
    reach = np.maximum(most - least, MIN_DEPTH_M)
    aspect = float(np.clip(reach[0] / reach[1], MIN_ASPECT, MAX_ASPECT))
    slope = math.tan(math.radians(FIELD_OF_VIEW_DEG) / 2) * (1 - 2 * MARGIN_FRACTION)
    slopes = np.array([slope * aspect, slope])
    most = np.max([_edges(_turn(each, axes), slopes) for each in blocks], axis=0)
    x, far_x = _fit(most[0], slope * aspect)
    y, far_y = _fit(most[1], slope)
    away = max(far_x, far_y, float(middle[2] + reach.max() * 1e-3))
    width = max(round(height * aspect / 2) * 2, 2)
    scale = height / 2 / math.tan(math.radians(FIELD_OF_VIEW_DEG) / 2)
    return Camera(np.array([x, y, away]) @ axes, axes, scale, width, height)


def _axes(azimuth: float, elevation: float) -> Floats:
    back = np.array(
        [
            math.sin(azimuth) * math.cos(elevation),
            math.sin(elevation),
            math.cos(azimuth) * math.cos(elevation),
        ]
    )
    right = np.array([math.cos(azimuth), 0.0, -math.sin(azimuth)])
    return np.stack((right, np.cross(back, right), back))


def _turn(points: AnyArray, axes: Floats) -> Floats:
    """Points (P, 3) along the axes."""
    return np.asarray(points, np.float64) @ axes.T


def _edges(seen: Floats, slopes: Floats) -> Floats:
    """Places (2, 2) of the outermost lines of sight on points (P, 3): in x and y, on both sides."""
    return np.array(
        [
            [(sign * seen[:, i] + slope * seen[:, 2]).max() for sign in (1.0, -1.0)]
            for i, slope in enumerate(slopes.tolist())
        ]
    )


def _fit(edges: Floats, slope: float) -> tuple[float, float]:
    """Eye position, sideways and backward, of the tightest field of view between the outermost lines of sight (2,)."""
    most, least = edges.tolist()
    return (most - least) / 2, (most + least) / (2 * slope)
