"""Filmstrips: what is in them, for files, caches and bare skeletons."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from anim.caches.transforms.up_axis import to_up_axis
from anim.errors import NotFoundError, RangeError, UnsupportedError
from anim.exchange.stick_mesh import stick_mesh
from anim.memory import memory_limit
from anim.model import Scene
from anim.model.vertex_cache import from_arrays
from anim.show.filmstrip import background, clips, renderer
from anim.show.filmstrip import filmstrip as filmstrip_module
from anim.show.filmstrip.camera import fit_camera
from anim.show.filmstrip.filmstrip import Extent, Strip, ViewOptions, animate_frames, filmstrip
from anim.show.filmstrip.frame_selection import FrameSelection
from anim.skinning.bake import Baker
from tests.calls import count_calls
from tests.clips import skeleton
from tests.files import opened_fixture

SMALL = ViewOptions(height=64)
FACE = np.array([[0, 1, 2]])


def strip(name: str, *, methods: tuple[str, ...] = (), heated: bool = False, clip: int = 0, **when: Any) -> Any:
    """The rows of a fixture, and its picture."""
    found = clips.of_document(opened_fixture(name), [clip], methods, FrameSelection(**when))
    rows, extent = clips.build_strips(found, heated=heated)
    return rows, filmstrip(rows, extent, title=name, look=SMALL)


def test_frames_lie_beside_each_other_and_move() -> None:
    rows, image = strip("biped", count=4)
    assert len(rows) == 1
    assert rows[0].times == pytest.approx([0, 1 / 3, 2 / 3, 1])
    width = (image.shape[1] - 2 * 12 + 3) // 4
    cells = [image[31 : 31 + 64, 12 + i * width : 12 + i * width + width - 3].astype(int) for i in range(4)]
    for one, other in pairwise(cells):
        assert np.abs(one - other).max() > 60
    for cell in cells:  # something is in it, and it isn't cut at the sides
        assert np.abs(cell[:, :1] - cell[:, -1:]).max() < 30
        assert cell.std() > 15


def test_the_same_input_gives_the_same_picture() -> None:
    assert (strip("biped", count=3)[1] == strip("biped", count=3)[1]).all()


def test_long_strips_go_on_in_a_next_line() -> None:
    _, one = strip("arm", count=3)
    _, two = strip("arm", count=60)
    assert two.shape[1] <= 1600
    assert two.shape[0] > one.shape[0] + 64


def test_heat_shows_where_methods_differ() -> None:
    rows, image = strip("tube", methods=("lbs", "dqs"), heated=True, clip=1, at=(0.0, 0.999))
    plain, heated = rows
    assert (plain.label, heated.label) == ("lbs", "dqs")
    assert plain.distances is None
    assert heated.distances[0].max() < 1e-6
    ring = heated.distances[1].reshape(-1)[48 * 48 : 49 * 48]  # where LBS pinches to nothing, the whole radius is off
    assert ring == pytest.approx(0.1, abs=1e-3)
    image = image.astype(int)
    violet = (image[..., 2] > image[..., 1] + 20) & (image[..., 0] > image[..., 1] + 20)
    assert violet[31:115].sum() == 0  # the first method has its own colors
    assert violet[115:].sum() > 20


def test_heat_of_one_method_is_the_distance_to_the_rest_pose() -> None:
    rows, _ = strip("arm", heated=True, at=(0.0, 1.0))
    assert rows[0].distances[0].max() < 1e-6
    assert rows[0].distances[1].max() > 0.01


def test_a_skeleton_without_a_mesh_is_drawn_as_sticks() -> None:
    document = opened_fixture("biped")
    nodes = [{k: v for k, v in node.items() if k not in ("mesh", "skin")} for node in document.json["nodes"]]
    bare = replace(document, json={**document.json, "nodes": nodes})
    rows, extent = clips.build_strips(clips.of_document(bare, [0], (), FrameSelection(count=2)))
    assert len(rows[0].faces) >= 8 * 10
    assert np.ptp(extent.points[:, 1]) > 1
    assert filmstrip(rows, extent, look=SMALL).std() > 5


def test_a_long_stick_is_no_wider_than_half_more_than_the_middle_one() -> None:
    joints = skeleton([-1, 0, 1, 2, 0], translation=[[0, 0, 0], [0, 0.1, 0], [0, 0.1, 0], [0, 0.1, 0], [1, 0, 0]])
    (instance,) = clips._visible(Scene(joints, ()), None).instances
    bodies = instance.mesh.positions.reshape(-1, 6, 3)  # start, end and four of the ring
    assert np.ptp(bodies, axis=1).max() == pytest.approx(1)
    widths = np.linalg.norm(bodies[:, 3] - bodies[:, 5], axis=1)
    assert widths.max() == pytest.approx(1.5 * np.median(widths))


def test_faces_of_sticks_share_their_corners() -> None:
    """A quarter of the vertices of the sticks in files, in the same places."""
    joints = skeleton([-1, 0, 1, 0], translation=[[0, 0, 0], [0, 0.3, 0], [0.1, 0.2, 0], [0.2, 0, 0.1]])
    whole, _ = stick_mesh(joints, frozenset({2, 3}))
    merged = clips._merge_corners(whole)
    assert len(merged.positions) * 4 == len(whole.positions)
    assert np.array_equal(merged.positions[merged.faces], whole.positions[whole.faces])
    assert np.array_equal(merged.joints[merged.faces], whole.joints[whole.faces])


def test_the_frames_of_the_camera_are_not_baked_again_if_they_are_those_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clips, "NUM_FRAMING_FRAMES", 8)
    counted = count_calls(monkeypatch, Baker, "bake")
    (same,) = clips.of_document(opened_fixture("arm"), [0], (), FrameSelection(count=8))
    assert (len(counted), same.path) == (1, same.cache)
    clips.of_document(opened_fixture("arm"), [0], (), FrameSelection(count=7))
    assert len(counted) == 3


def test_a_cache_with_z_up_stands() -> None:
    points = np.array([[[0, 0, 0], [1, 0, 0], [0, 2, 0]]], np.float32)
    cache = from_arrays(np.zeros(1), points, FACE)
    for each in (cache, to_up_axis(cache, "z")):
        (shot,) = clips.of_cache(each, FrameSelection(count=3))
        assert shot.cache.load_all().positions == pytest.approx(points)


def test_nearer_faces_hide_others() -> None:
    near, far = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1.0]]), np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    colors = np.array([[1.0, 0, 0], [0, 0, 1]])
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    positions = np.concatenate((near, far))[None]
    look = ViewOptions(height=64, azimuth=0, elevation=0)
    image = filmstrip([Strip("", np.zeros(1), positions, faces, colors)], Extent(positions[0], 0.0), look=look).astype(
        int
    )
    is_red, is_blue = image[..., 0] > image[..., 2] + 60, image[..., 2] > image[..., 0] + 60
    assert is_red.sum() > 10 * is_blue.sum()


def test_moving_pictures_have_their_rows_side_by_side() -> None:
    found = clips.of_document(opened_fixture("arm"), [0], ("lbs", "dqs"), FrameSelection(count=3))
    rows, extent = clips.build_strips(found)
    one, *others = animate_frames(rows, extent, title="arm", look=SMALL)
    assert len(others) == 2
    assert all(image.shape == one.shape for image in others)
    alone = next(animate_frames(rows[:1], extent, look=SMALL))
    assert one.shape[1] > alone.shape[1]


def _turning(times: list[float], *, back: bool) -> Strip:
    """A triangle that moves to the right, and back where it began or not."""
    way = np.linspace(0, 1, len(times))
    way = np.minimum(way, 1 - way) if back else way
    positions = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]) + way[:, None, None] * np.array([1.0, 0, 0])
    return Strip("", np.array(times), positions, FACE, np.full((1, 3), 0.5))


def test_the_shorter_rows_of_a_film_wait_for_the_longest() -> None:
    short, long = _turning([0, 0.1], back=False), _turning([0, 0.1, 0.2, 0.3], back=False)
    pictures = list(animate_frames([short, long], Extent(long.positions[[0, -1]], 0.0), look=SMALL))
    assert len(pictures) == 4
    half = pictures[0].shape[1] // 2
    assert not (pictures[0][:, :half] == pictures[1][:, :half]).all()
    assert (pictures[1][:40, :half] == pictures[3][:40, :half]).all(), "the time is below"
    assert not (pictures[2][:, half:] == pictures[3][:, half:]).all()


@pytest.mark.parametrize(("back", "frames"), [(True, 4), (False, 5)])
def test_a_loop_shows_its_first_frame_once(back: bool, frames: int) -> None:
    row = _turning([0, 0.25, 0.5, 0.75, 1], back=back)
    assert len(list(animate_frames([row], Extent(row.positions[[0, -1]], 0.0), look=SMALL))) == frames
    still = Strip("", row.times, row.positions[[0] * 5], FACE, row.colors)
    assert len(list(animate_frames([still], Extent(row.positions[[0, -1]], 0.0), look=SMALL))) == 5, (
        "what doesn't move is no loop"
    )


@pytest.mark.parametrize("look", [SMALL, replace(SMALL, checker=True, wire=True)])
@pytest.mark.parametrize("name", ["biped", "tube"])
def test_pictures_are_the_same_in_bands(name: str, look: ViewOptions, monkeypatch: pytest.MonkeyPatch) -> None:
    rows, extent = clips.build_strips(clips.of_document(opened_fixture(name), [0], (), FrameSelection(count=2)))
    once = filmstrip(rows, extent, look=look)
    for samples in (1, 5000):
        monkeypatch.setattr(renderer, "MAX_BAND_SAMPLES", samples)
        assert np.array_equal(filmstrip(rows, extent, look=look), once)


def test_the_grid_is_the_same_in_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.array([[0, 0, 0], [1, 1, 1]], np.float64)
    camera = fit_camera(points, height=64)
    whole = background.setup_view(camera, points, 0.0).grid
    for rows in (1, 7):
        monkeypatch.setattr(background, "MAX_BAND_PIXELS", rows * camera.width)
        assert np.array_equal(background.setup_view(camera, points, 0.0).grid, whole)


def test_marks_on_the_ground_are_the_same_in_bands() -> None:
    points = np.array(list(product((0.0, 1.0), repeat=3)))
    view = background.setup_view(fit_camera(points, height=64), points, 0.0)
    moved = background.translate_view(view, np.zeros(2), np.array([[0.5, 0.5], [0.2, 0.9], [99, 0]]))
    whole = background.background_rows(moved, slice(None))
    assert len(moved.dots) == 2
    assert np.abs(whole - background.background_rows(view, slice(None))).max() > 0.1
    bands = [background.background_rows(moved, slice(top, top + 7)) for top in range(0, 64, 7)]
    assert np.array_equal(np.concatenate(bands), whole)


def test_more_pixels_than_memory_should_hold_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    row = _turning([0, 0.25, 0.5], back=False)
    monkeypatch.setattr(filmstrip_module, "setup_view", None)  # nothing is drawn before
    with memory_limit(100_000):
        with pytest.raises(UnsupportedError, match=r"a picture of \d+ × \d+ pixels would take 0\.0\d+ GB or more"):
            filmstrip([row], Extent(row.positions[0], 0.0), look=SMALL)
        with pytest.raises(UnsupportedError, match=r"3 frames of \d+ × \d+ pixels would take"):
            next(animate_frames([row], Extent(row.positions[0], 0.0), look=SMALL))


@pytest.mark.parametrize(
    ("when", "times"),
    [
        (FrameSelection(at=(1.0, 0.5, 0.5)), [0.5, 1.0]),
        (FrameSelection(at=(1.0, 2.5)), [1.0]),
        (FrameSelection(count=3), [0, 1, 2]),
        (FrameSelection(count=1), [0]),
        (FrameSelection(count=3, begin=1), [1, 1.5, 2]),
        (FrameSelection(fps=2, end=1), [0, 0.5, 1]),
        (FrameSelection(count=2, begin=-5, end=9), [0, 2]),
    ],
)
def test_times(when: FrameSelection, times: list[float]) -> None:
    assert when.times(0.0, 2.0).tolist() == times


def test_what_can_t_be_shown_is_refused() -> None:
    with pytest.raises(RangeError, match="nothing lies"):
        FrameSelection(count=2, begin=3).times(0, 2)
    with pytest.raises(UnsupportedError, match="limit 3000"):
        FrameSelection(fps=9999).times(0, 2)
    with pytest.raises(NotFoundError, match="no faces"):
        clips.of_cache(from_arrays(np.zeros(1), np.zeros((1, 3, 3)), np.empty((0, 3), np.int64)), FrameSelection())
    with pytest.raises(RangeError, match="expected lbs"):
        clips.of_document(opened_fixture("arm"), [0], ("foo",), FrameSelection())
    with pytest.raises(RangeError, match="32"):
        filmstrip([], Extent(np.zeros((1, 3)), 0.0), look=ViewOptions(height=3))
