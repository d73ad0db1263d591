"""Rendering of one frame of a mesh: flat-shaded on a ground with a grid and a soft shadow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from anim.arrays import AnyArray, Bools, Floats, Ints
from anim.show.filmstrip.camera import Camera
from anim.show.filmstrip.rasterizer import MAX_BATCH_FACES, visible_faces
from anim.show.filmstrip.surface_pattern import SurfaceMarks

if TYPE_CHECKING:
    from anim.show.filmstrip.surface import Surface

SAMPLES = 3  # across and down in each pixel
MAX_BAND_PIXELS = 1 << 16  # of the background, drawn at a time: 500 bytes each
MAX_BAND_SAMPLES = 1 << 20  # samples drawn at a time, approximately: 60 bytes each
# Linear light.
SKY, EARTH = np.array([0.86, 0.875, 0.89]), np.array([0.70, 0.70, 0.70])  # background, from top to bottom
LINE, SHADOW = np.array([0.52, 0.53, 0.55]), np.array([0.16, 0.17, 0.20])
KEY, FILL = np.array([-0.45, 0.80, 0.55]), np.array([0.75, 0.25, 0.30])  # directions of lights, in the camera's frame
KEY_LIGHT, FILL_LIGHT, FROM_ABOVE, FROM_BELOW = 0.72, 0.14, 0.34, 0.16
SHADOW_DEPTH = 0.55  # fraction of light removed by the shadow
SHADOW_LIGHT_SCALE = 0.5  # scale of the horizontal direction of the shadow light, for short shadows
SHADOW_BLUR = 0.012  # of the picture's height
CELLS = 7.0  # squares of the grid across the motion, about
GRID_DEPTH = 0.38
DOT, DOT_DEPTH = 0.08, 0.75  # radius of marks on the ground relative to their spacing, and their darkness
GRID_RADIUS = 1.6  # radii of the motion; distance from its center at which the grid ends
GAMMA = 2.2


@dataclass(frozen=True, slots=True)
class SceneView:
    """View of all frames. ground: its height, m. middle: (2,) x and z of the motion, m; reach: its radius.

    background: (H, W, 3) linear, with the grid for the initial camera position.
    """

    camera: Camera
    ground: float
    middle: Floats
    reach: float
    background: Floats


def setup_view(camera: Camera, points: AnyArray, ground: float) -> SceneView:
    """Return the view of a motion with the vertices `points` (P, 3), and the ground at a height in m."""
    low, high = (np.asarray(each, np.float64) for each in (points.min(axis=0), points.max(axis=0)))
    middle = (low[[0, 2]] + high[[0, 2]]) / 2
    reach = max(float(np.linalg.norm(high - low)) / 2, 1e-6)
    return SceneView(camera, ground, middle, reach, _background(camera, ground, middle, reach, np.zeros(2)))


def translate_view(stage: SceneView, place: Floats, milestones: Floats) -> SceneView:
    """Return the view of a camera translated by `place` (2,), m in x and z from its initial position.

    milestones: (M, 2) m of x and z, shown as dots on the ground.
    """
    camera, ground = stage.camera, stage.ground
    background = _background(camera, ground, stage.middle, stage.reach, place)
    spots = np.zeros((len(milestones), 3))
    spots[:, 1] = ground
    spots[:, [0, 2]] = milestones - place
    for spot in spots[np.linalg.norm(milestones - place - stage.middle, axis=1) < GRID_RADIUS * stage.reach]:
        _draw_dot(background, camera, spot, DOT * mark_spacing(stage))
    return replace(stage, background=background)


def mark_spacing(stage: SceneView) -> float:
    """Return the distance in m between marks along the root path of a followed figure."""
    return round_down(stage.reach / 2)


def render_frame(
    stage: SceneView,
    positions: Floats,
    faces: Ints,
    colors: Floats,
    marks: Sequence[SurfaceMarks] = (),
    surface: Surface | None = None,
    *,
    tinted: bool = True,
) -> Floats:
    """Return the picture (H, W, 3) in linear light. positions: (V, 3) m. faces: (T, 3). colors: (T, 3).

    marks: drawn on the surface, in order. surface: materials; their alpha always applies, their colors multiply the
    others if `tinted`.
    """
    camera = stage.camera
    corners = _enlarge(camera, SAMPLES).project(positions)[faces]
    painted = np.concatenate((colors * _shade(camera, positions, faces)[:, None], np.zeros((1, 3))))
    picture = stage.background.copy()
    picture *= 1 - _shadow(stage, positions, faces, surface)[..., None] * (1 - SHADOW)
    rows = max(MAX_BAND_SAMPLES // (camera.width * SAMPLES**2), 1)
    for top in range(0, camera.height, rows):
        _paint(picture[top : top + rows], corners - (0, top * SAMPLES, 0), painted, marks, surface, tinted=tinted)
    return picture


def _paint(
    band: Floats,
    corners: Floats,
    painted: Floats,
    marks: Sequence[SurfaceMarks],
    surface: Surface | None,
    *,
    tinted: bool,
) -> None:
    """Draw triangles into rows (H, W, 3) of a picture. painted: (T + 1, 3), colors of triangles and none."""
    height, width = band.shape[:2]
    alpha_test = None if surface is None else surface.alpha_test(corners)
    seen = visible_faces(corners, width=width * SAMPLES, height=height * SAMPLES, alpha_test=alpha_test)
    shape = (height, SAMPLES, width, SAMPLES)
    cover = (seen >= 0).reshape(shape).mean(axis=(1, 3))[..., None]
    colors = painted[seen]
    y, x = np.nonzero(seen >= 0)
    if surface is not None and tinted:
        colors[y, x] *= surface.tint(corners, np.stack((x + 0.5, y + 0.5), axis=1), seen[y, x])
    for mark in marks:
        chosen = seen[y, x]
        shown = corners[chosen] * (1 / SAMPLES, 1 / SAMPLES, 1)
        samples = np.stack(((x + 0.5) / SAMPLES, (y + 0.5) / SAMPLES), axis=1)
        colors[y, x] *= mark(shown, samples, chosen)[:, None]
    band *= 1 - cover
    band += colors.reshape(*shape, 3).mean(axis=(1, 3))


def to_srgb(image: Floats) -> np.ndarray:
    """Return linear light as sRGB bytes, approximated by a single power."""
    return np.rint(np.clip(image, 0, 1) ** (1 / GAMMA) * 255).astype(np.uint8)


def _enlarge(camera: Camera, times: int) -> Camera:
    return Camera(camera.eye, camera.axes, camera.scale * times, camera.width * times, camera.height * times)


def _shade(camera: Camera, positions: Floats, faces: Ints) -> Floats:
    """Brightness (T,) of faces: key light, fill light and sky."""
    result = np.empty(len(faces))
    for start in range(0, len(faces), MAX_BATCH_FACES):
        some = slice(start, start + MAX_BATCH_FACES)
        result[some] = _shade_some(camera, positions, faces[some])
    return result


def _shade_some(camera: Camera, positions: Floats, faces: Ints) -> Floats:
    a, b, c = (positions[faces[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0, length, 1)
    away = np.einsum("ti,ti->t", normals, a - camera.eye) > 0
    normals = np.where(away[:, None], -normals, normals)
    light = np.full(len(faces), 0.0)
    for direction, strength in ((KEY, KEY_LIGHT), (FILL, FILL_LIGHT)):
        world = direction / np.linalg.norm(direction) @ camera.axes
        light += strength * np.maximum(normals @ world, 0)
    above = (1 + normals[:, 1]) / 2
    return light + FROM_BELOW + (FROM_ABOVE - FROM_BELOW) * above


def _background(camera: Camera, ground: float, middle: Floats, reach: float, place: Floats) -> Floats:
    picture = np.empty((camera.height, camera.width, 3))
    step = max(MAX_BAND_PIXELS // camera.width, 1)
    for top in range(0, camera.height, step):
        first, end = max(top - 1, 0), min(top + step, camera.height)
        band = _background_rows(camera, slice(first, end + 1), ground, middle, reach, place)
        picture[top:end] = band[top - first : end - first]
    return picture


def _background_rows(camera: Camera, rows: slice, ground: float, middle: Floats, reach: float, place: Floats) -> Floats:
    """Rows of the background; the first and the last one are exact at the picture's edges only."""
    share = np.linspace(0, 1, camera.height)[rows, None, None]
    image = SKY * (1 - share) + EARTH * share
    rays = camera.rays(rows)
    down, height = -rays[..., 1], camera.eye[1] - ground
    is_ground = (down > 1e-6) & (height > 0)
    far = height / np.where(is_ground, down, 1)
    places = camera.eye[[0, 2]] + rays[..., [0, 2]] * far[..., None]
    fade = np.clip(1.25 - np.linalg.norm(places - middle, axis=-1) / (GRID_RADIUS * reach), 0, 1)
    step = round_down(2 * reach / CELLS)
    line = np.maximum(*(_lines(places[..., i] + place[i], step) for i in (0, 1)))
    line = np.where(is_ground, line * fade * GRID_DEPTH, 0)[..., None]
    picture: Floats = image * (1 - line) + LINE * line
    return picture


def _draw_dot(image: Floats, camera: Camera, spot: Floats, radius: float) -> None:
    """Draw a disc on the ground, projected as an ellipse."""
    x, y, near = camera.project(spot)
    across = max(radius * near * camera.scale, 1.2)
    away = (camera.eye - spot) / np.linalg.norm(camera.eye - spot)
    down = max(across * abs(float(away[1])), 0.8)
    dx = (np.arange(camera.width) + 0.5 - x) / across
    dy = (np.arange(camera.height) + 0.5 - y) / down
    off = np.hypot(dx[None, :], dy[:, None])
    depth = DOT_DEPTH * np.clip((1 - off) * down + 0.5, 0, 1)[..., None]
    image += (LINE * 0.5 - image) * depth


def _lines(places: Floats, step: float) -> Floats:
    """Coverage (H, W) of pixels by lines of a grid of this step, faded for dense lines."""
    spread = np.abs(np.gradient(places, axis=0)) + np.abs(np.gradient(places, axis=1)) + 1e-9
    off = np.abs((places / step + 0.5) % 1 - 0.5) * step
    found: Floats = np.clip(1 - off / (0.75 * spread), 0, 1) * np.clip(step / (6 * spread), 0, 1)
    return found


def round_down(length: float) -> float:
    """Return the greatest of …, 1, 2, 5, 10, … below a length."""
    power = 10.0 ** math.floor(math.log10(length))
    return max(factor * power for factor in (1, 2, 5) if factor * power <= length * 1.0001)


def _shadow(stage: SceneView, positions: Floats, faces: Ints, surface: Surface | None) -> Floats:
    """Darkness (H, W) of the ground: the blurred shadow of the key light."""
    camera = stage.camera
    if camera.eye[1] <= stage.ground:
        return np.zeros((camera.height, camera.width))
    light = KEY / np.linalg.norm(KEY) @ camera.axes * (SHADOW_LIGHT_SCALE, 1, SHADOW_LIGHT_SCALE)
    light[1] = max(light[1], 0.6)
    above = np.maximum(positions[:, 1] - stage.ground, 0)
    fallen = positions - (above / light[1])[:, None] * light
    fallen[:, 1] = stage.ground
    corners = camera.project(fallen)[faces]
    alpha_test = None if surface is None else surface.alpha_test(corners)
    mask = visible_faces(corners, width=camera.width, height=camera.height, alpha_test=alpha_test) >= 0
    return SHADOW_DEPTH * _blur(mask, max(round(SHADOW_BLUR * camera.height), 1))


def _blur(mask: Bools, radius: int) -> Floats:
    from PIL import Image, ImageFilter

    box = ImageFilter.BoxBlur(radius)
    blurred = Image.fromarray(mask.astype(np.uint8) * 255).filter(box).filter(box)
    return np.asarray(blurred, np.float64) / 255
