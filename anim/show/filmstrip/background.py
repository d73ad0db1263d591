"""Background of all frames: sky, and a ground with a grid and marks; drawn in rows, so that it takes little memory."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.show.filmstrip.camera import Camera

MAX_BAND_PIXELS = 1 << 16  # of the grid, computed at a time: 500 bytes each
# Linear light.
SKY, EARTH = np.array([0.86, 0.875, 0.89]), np.array([0.70, 0.70, 0.70])  # background, from top to bottom
LINE = np.array([0.52, 0.53, 0.55])
CELLS = 7.0  # squares of the grid across the motion, about
GRID_DEPTH = 0.38
DOT, DOT_DEPTH = 0.08, 0.75  # radius of marks on the ground relative to their spacing, and their darkness
GRID_RADIUS = 1.6  # radii of the motion; distance from its center at which the grid ends


@dataclass(frozen=True, slots=True)
class SceneView:
    """View of all frames. ground: its height, m. middle: (2,) x and z of the motion, m; reach: its radius.

    grid: (H, W) fraction of each pixel that lines of the grid cover, for the camera's position. dots: (D, 3) m, on the
    ground.
    """

    camera: Camera
    ground: float
    middle: Floats
    reach: float
    grid: Floats
    dots: Floats


def setup_view(camera: Camera, points: AnyArray, ground: float) -> SceneView:
    """Return the view of a motion with the vertices `points` (P, 3), and the ground at a height in m."""
    low, high = (np.asarray(each, np.float64) for each in (points.min(axis=0), points.max(axis=0)))
    middle = (low[[0, 2]] + high[[0, 2]]) / 2
    reach = max(float(np.linalg.norm(high - low)) / 2, 1e-6)
    return SceneView(camera, ground, middle, reach, _grid(camera, ground, middle, reach, np.zeros(2)), np.zeros((0, 3)))


def translate_view(view: SceneView, place: Floats, milestones: Floats) -> SceneView:
    """Return the view of a camera translated by `place` (2,), m in x and z from its initial position.

    milestones: (M, 2) m of x and z, shown as dots on the ground.
    """
    grid = _grid(view.camera, view.ground, view.middle, view.reach, place)
    spots = np.zeros((len(milestones), 3))
    spots[:, 1] = view.ground
    spots[:, [0, 2]] = milestones - place
    is_near = np.linalg.norm(milestones - place - view.middle, axis=1) < GRID_RADIUS * view.reach
    return replace(view, grid=grid, dots=spots[is_near])


def mark_spacing(view: SceneView) -> float:
    """Return the distance in m between marks along the root path of a followed figure."""
    return round_down(view.reach / 2)


def background_rows(view: SceneView, rows: slice) -> Floats:
    """Return rows (R, W, 3) of the background in linear light."""
    share = np.linspace(0, 1, view.camera.height)[rows, None, None]
    line = view.grid[rows, :, None]
    image: Floats = (SKY * (1 - share) + EARTH * share) * (1 - line)
    image += LINE * line
    for dot in view.dots:
        _draw_dot(image, rows, view.camera, dot, DOT * mark_spacing(view))
    return image


def round_down(length: float) -> float:
    """Return the greatest of …, 1, 2, 5, 10, … below a length."""
    power = 10.0 ** math.floor(math.log10(length))
    return max(factor * power for factor in (1, 2, 5) if factor * power <= length * 1.0001)


def _grid(camera: Camera, ground: float, middle: Floats, reach: float, place: Floats) -> Floats:
    grid = np.empty((camera.height, camera.width))
    step = max(MAX_BAND_PIXELS // camera.width, 1)
    for top in range(0, camera.height, step):
        first, end = max(top - 1, 0), min(top + step, camera.height)
        band = _grid_rows(camera, slice(first, end + 1), ground, middle, reach, place)
        grid[top:end] = band[top - first : end - first]
    return grid


def _grid_rows(camera: Camera, rows: slice, ground: float, middle: Floats, reach: float, place: Floats) -> Floats:
    """Rows of the grid; the first and the last one are exact at the picture's edges only."""
    rays = camera.rays(rows)
    down, height = -rays[..., 1], camera.eye[1] - ground
    is_ground = (down > 1e-6) & (height > 0)
    far = height / np.where(is_ground, down, 1)
    places = camera.eye[[0, 2]] + rays[..., [0, 2]] * far[..., None]
    fade = np.clip(1.25 - np.linalg.norm(places - middle, axis=-1) / (GRID_RADIUS * reach), 0, 1)
    step = round_down(2 * reach / CELLS)
    line = np.maximum(*(_lines(places[..., i] + place[i], step) for i in (0, 1)))
    return np.where(is_ground, line * fade * GRID_DEPTH, 0)


def _lines(places: Floats, step: float) -> Floats:
    """Coverage (H, W) of pixels by lines of a grid of this step, faded for dense lines."""
    spread = np.abs(np.gradient(places, axis=0)) + np.abs(np.gradient(places, axis=1)) + 1e-9
    off = np.abs((places / step + 0.5) % 1 - 0.5) * step
    found: Floats = np.clip(1 - off / (0.75 * spread), 0, 1) * np.clip(step / (6 * spread), 0, 1)
    return found


def _draw_dot(image: Floats, rows: slice, camera: Camera, spot: Floats, radius: float) -> None:
    """Draw a disc on the ground, projected as an ellipse, into some rows of the picture."""
    x, y, near = camera.project(spot)
    across = max(radius * near * camera.scale, 1.2)
    away = (camera.eye - spot) / np.linalg.norm(camera.eye - spot)
    down = max(across * abs(float(away[1])), 0.8)
    dx = (np.arange(camera.width) + 0.5 - x) / across
    dy = (np.arange(camera.height)[rows] + 0.5 - y) / down
    off = np.hypot(dx[None, :], dy[:, None])
    depth = DOT_DEPTH * np.clip((1 - off) * down + 0.5, 0, 1)[..., None]
    image += (LINE * 0.5 - image) * depth
