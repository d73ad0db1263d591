"""Rendering of one frame of a mesh: flat-shaded on a ground with a grid and a soft shadow.

It is drawn in bands of rows, from the background to the bytes: memory hardly grows with the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Bools, Floats, Ints
from anim.show.filmstrip.background import SceneView, background_rows
from anim.show.filmstrip.camera import Camera
from anim.show.filmstrip.rasterizer import MAX_BATCH_FACES, visible_faces
from anim.show.filmstrip.surface_pattern import SurfaceMarks

if TYPE_CHECKING:
    from anim.show.filmstrip.surface import Surface

SAMPLES = 3  # across and down in each pixel
MAX_BAND_SAMPLES = 1 << 18  # samples drawn at a time, approximately: 150 bytes each
# Linear light.
SHADOW = np.array([0.16, 0.17, 0.20])
KEY, FILL = np.array([-0.45, 0.80, 0.55]), np.array([0.75, 0.25, 0.30])  # directions of lights, in the camera's frame
KEY_LIGHT, FILL_LIGHT, FROM_ABOVE, FROM_BELOW = 0.72, 0.14, 0.34, 0.16
SHADOW_DEPTH = 0.55  # fraction of light removed by the shadow
SHADOW_LIGHT_SCALE = 0.5  # scale of the horizontal direction of the shadow light, for short shadows
SHADOW_BLUR = 0.012  # of the picture's height
GAMMA = 2.2

Image = NDArray[np.uint8]


def render_frame(
    view: SceneView,
    positions: Floats,
    faces: Ints,
    colors: Floats,
    marks: Sequence[SurfaceMarks] = (),
    surface: Surface | None = None,
    *,
    tinted: bool = True,
) -> Image:
    """Return the picture (H, W, 3) in sRGB. positions: (V, 3) m. faces: (T, 3). colors: (T, 3), linear.

    marks: drawn on the surface, in order. surface: materials; their alpha always applies, their colors multiply the
    others if `tinted`.
    """
    camera = view.camera
    corners = _enlarge(camera, SAMPLES).project(positions)[faces]
    painted = np.concatenate((colors * _shade(camera, positions, faces)[:, None], np.zeros((1, 3))))
    shadow = _shadow(view, positions, faces, surface)
    picture = np.empty((camera.height, camera.width, 3), np.uint8)
    step = max(MAX_BAND_SAMPLES // (camera.width * SAMPLES**2), 1)
    for top in range(0, camera.height, step):
        rows = slice(top, top + step)
        band = background_rows(view, rows)
        band *= 1 - (SHADOW_DEPTH * (shadow[rows].astype(np.float64) / 255))[..., None] * (1 - SHADOW)
        _paint(band, top, corners, painted, marks, surface, tinted=tinted)
        picture[rows] = to_srgb(band)
    return picture


def _paint(
    band: Floats,
    top: int,
    corners: Floats,
    painted: Floats,
    marks: Sequence[SurfaceMarks],
    surface: Surface | None,
    *,
    tinted: bool,
) -> None:
    """Draw triangles into rows (H, W, 3) of a picture from `top` on. painted: (T + 1, 3), colors of triangles and none.

    corners: (T, 3, 3) of triangles in samples of the whole picture.
    """
    height, width = band.shape[:2]
    alpha_test = None if surface is None else surface.alpha_test(corners)
    first = top * SAMPLES
    seen = visible_faces(corners, width=width * SAMPLES, height=height * SAMPLES, top=first, alpha_test=alpha_test)
    shape = (height, SAMPLES, width, SAMPLES)
    cover = (seen >= 0).reshape(shape).mean(axis=(1, 3))[..., None]
    colors = painted[seen]
    y, x = np.nonzero(seen >= 0)
    if surface is not None and tinted:
        colors[y, x] *= surface.tint(corners, np.stack((x + 0.5, y + first + 0.5), axis=1), seen[y, x])
    for mark in marks:
        chosen = seen[y, x]
        shown = corners[chosen] * (1 / SAMPLES, 1 / SAMPLES, 1)
        samples = np.stack(((x + 0.5) / SAMPLES, (y + first + 0.5) / SAMPLES), axis=1)
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


def _shadow(view: SceneView, positions: Floats, faces: Ints, surface: Surface | None) -> Image:
    """Darkness (H, W) of the ground, 0 … 255: the blurred shadow of the key light."""
    camera = view.camera
    mask = np.zeros((camera.height, camera.width), bool)
    if camera.eye[1] <= view.ground:
        return mask.astype(np.uint8)
    light = KEY / np.linalg.norm(KEY) @ camera.axes * (SHADOW_LIGHT_SCALE, 1, SHADOW_LIGHT_SCALE)
    light[1] = max(light[1], 0.6)
    above = np.maximum(positions[:, 1] - view.ground, 0)
    fallen = positions - (above / light[1])[:, None] * light
    fallen[:, 1] = view.ground
    corners = camera.project(fallen)[faces]
    alpha_test = None if surface is None else surface.alpha_test(corners)
    step = max(MAX_BAND_SAMPLES // camera.width, 1)
    for top in range(0, camera.height, step):
        band = mask[top : top + step]
        band[:] = visible_faces(corners, width=camera.width, height=len(band), top=top, alpha_test=alpha_test) >= 0
    return _blur(mask, max(round(SHADOW_BLUR * camera.height), 1))


def _blur(mask: Bools, radius: int) -> Image:
    from PIL import Image as Pillow
    from PIL import ImageFilter

    box = ImageFilter.BoxBlur(radius)
    return np.asarray(Pillow.fromarray(mask.view(np.uint8) * np.uint8(255)).filter(box).filter(box))
