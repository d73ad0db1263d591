"""The z-buffer against a loop over pixels, the camera against its own picture, the PNG against Pillow."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from anim.arrays import Floats, Ints
from anim.errors import RangeError
from anim.show.filmstrip import image_file, palette
from anim.show.filmstrip.background import round_down
from anim.show.filmstrip.camera import fit_camera
from anim.show.filmstrip.rasterizer import visible_faces

RANDOM = np.random.default_rng(8)


def by_loops(corners: Floats, width: int, height: int) -> Ints:
    """The nearest triangle at the middle of each pixel, by signs of areas."""
    seen: Ints = np.full((height, width), -1)
    nearest = np.full((height, width), -np.inf)
    for t, triangle in enumerate(corners):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = triangle
        whole = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        for y in range(height):
            for x in range(width):
                px, py = x + 0.5, y + 0.5
                a = ((bx - px) * (cy - py) - (cx - px) * (by - py)) / whole
                b = ((cx - px) * (ay - py) - (ax - px) * (cy - py)) / whole
                near = a * az + b * bz + (1 - a - b) * cz
                if min(a, b, 1 - a - b) >= 0 and near > nearest[y, x]:
                    seen[y, x], nearest[y, x] = t, near
    return seen


@pytest.mark.parametrize("spread", [4.0, 15.0, 80.0])
def test_the_nearest_triangle_is_seen(spread: float) -> None:
    middles = RANDOM.uniform(-5, 35, (40, 1, 3))
    corners = middles + RANDOM.normal(scale=spread, size=(40, 3, 3))
    assert (visible_faces(corners, width=31, height=23) == by_loops(corners, 31, 23)).all()


def test_neighbors_leave_no_gap_and_axes_are_met() -> None:
    square = np.array([[[0, 0, 1], [20, 0, 1], [20, 20, 1]], [[0, 0, 1], [20, 20, 1], [0, 20, 1]]], float)
    assert (visible_faces(square, width=20, height=20) >= 0).all()
    one = np.array([[[2, 3, 1], [5, 3, 1], [2, 6, 1]]], float)  # middles of pixels on its long edge count
    assert np.argwhere(visible_faces(one, width=9, height=9) == 0).tolist() == [
        [3, 2],
        [3, 3],
        [3, 4],
        [4, 2],
        [4, 3],
        [5, 2],
    ]


def test_what_can_t_be_drawn_is_left_out() -> None:
    flat = [[0, 0, 1], [5, 5, 1], [9, 9, 1]]
    nowhere = [[np.nan, 0, 1], [5, 0, 1], [0, 5, 1]]
    outside = [[-9, -9, 1], [-5, -9, 1], [-9, -5, 1]]
    assert (visible_faces(np.array([flat, nowhere, outside], float), width=9, height=9) == -1).all()
    assert (visible_faces(np.empty((0, 3, 3)), width=4, height=3) == -1).all()


@pytest.mark.parametrize("stretch", [(1, 1, 1), (9, 1, 1), (1, 9, 1), (1, 1, 9), (0, 0, 0), (1e-3, 1e-3, 1e-3)])
@pytest.mark.parametrize("azimuth", [0, 35, 200])
def test_the_camera_holds_all_points(stretch: tuple[float, float, float], azimuth: float) -> None:
    points = RANDOM.normal(size=(300, 3)) * stretch + [4, -2, 7]
    camera = fit_camera(points, height=200, azimuth=azimuth)
    x, y, near = camera.project(points).T
    assert (near > 0).all()
    assert 0 < x.min() <= x.max() < camera.width
    assert 0 < y.min() <= y.max() < 200
    if stretch == (1, 1, 1):  # and not much more: one side or the other is nearly full
        assert max(np.ptp(x) / camera.width, np.ptp(y) / 200) > 0.8


def test_rays_go_through_their_pixels() -> None:
    camera = fit_camera(RANDOM.normal(size=(50, 3)), height=64)
    places = camera.eye + 3.7 * camera.rays()
    x, y, _ = np.moveaxis(camera.project(places), -1, 0)
    assert x == pytest.approx(np.broadcast_to(np.arange(camera.width) + 0.5, x.shape))
    assert y == pytest.approx(np.broadcast_to(np.arange(64)[:, None] + 0.5, y.shape))


@pytest.mark.parametrize("shape", [(1, 1, 3), (40, 31, 3)])
def test_pillow_reads_the_png(shape: tuple[int, int, int]) -> None:
    image = RANDOM.integers(0, 256, shape).astype(np.uint8)
    image[shape[0] // 2 :] //= 7
    back = Image.open(io.BytesIO(image_file.png(image)))
    assert back.mode == "RGB"
    assert "srgb" in back.info
    assert (np.asarray(back) == image).all()


def test_heat_gets_darker_and_ends_at_the_farthest() -> None:
    colors = palette.colors(np.linspace(0, 1, 50))
    assert (np.diff(colors.sum(axis=1)) < 0).sum() > 40
    assert palette.heat_colors(np.array([0.0, 0, 0]), np.array([[0, 1, 2]]), 0.0) == pytest.approx(palette.STOPS[:1])
    assert palette.heat_colors(np.array([2.0, 2, 2]), np.array([[0, 1, 2]]), 2.0) == pytest.approx(palette.STOPS[-1:])


@pytest.mark.parametrize(("length", "step"), [(1.0, 1.0), (0.99, 0.5), (19, 10), (5.1, 5), (0.0021, 0.002)])
def test_steps_of_the_grid_are_round(length: float, step: float) -> None:
    assert round_down(length) == pytest.approx(step)


@pytest.mark.parametrize(("ending", "tick"), [(".gif", 10), (".webp", 1), (".apng", 1)])
@pytest.mark.parametrize("fps", [7.0, 15, 24, 29.97, 50])
def test_films_take_as_long_as_they_should(ending: str, tick: int, fps: float) -> None:
    found = image_file.durations_ms(31, ending, fps=fps)
    assert abs(sum(found) - 31_000 / fps) <= tick / 2
    assert all(each > 0 and each % tick == 0 for each in found)
    assert max(found) - min(found) <= tick


def test_gifs_can_t_be_as_quick_as_others() -> None:
    picture = np.zeros((8, 8, 3), np.uint8)
    with pytest.raises(RangeError, match=r"60 frames per second are too many for \.gif \(limit 50\)"):
        image_file.animation([picture], ".gif", fps=60)
    assert image_file.animation([picture, picture + 9], ".webp", fps=60)
