"""A camera that goes with a figure that travels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip
from anim.model.vertex_cache import from_arrays
from anim.show.filmstrip import clips, root_path
from anim.show.filmstrip.camera import fit_camera
from anim.show.filmstrip.filmstrip import ViewOptions, filmstrip
from anim.show.filmstrip.frame_selection import FrameSelection
from tests.files import opened_fixture

BODY = np.array([[0, 0, 0], [0.5, 0, 0], [0, 1.7, 0.2]])
FACE = np.array([[0, 1, 2]])


def walking(speed: float) -> Document:
    """The biped's walk, carried along +Z at a speed in m/s."""
    document = opened_fixture("biped")
    (walk, *_) = reader.clips(document)
    tracks = [
        replace(each, values=each.values + np.outer(each.times, [0, 0, speed])) if each.path == "translation" else each
        for each in walk.tracks
    ]
    return writer.replace_clips(document, {0: Clip("walk", tuple(tracks))})


def _seen_sizes(document: Document, followed: bool | None) -> tuple[np.ndarray, np.ndarray]:
    """Height and distance from the middle of the figure in each frame, as shares of the picture."""
    rows, extent = clips.build_strips(clips.of_document(document, [0], (), FrameSelection(count=7)), followed=followed)
    camera = fit_camera(extent.points.astype(float), height=200)
    (row,) = rows
    sizes, off = [], []
    for time, positions in zip(row.times, row.positions.astype(float), strict=True):
        if row.root_path is not None:
            positions[:, [0, 2]] -= row.root_path.at(time)
        seen = camera.project(positions)
        sizes.append(np.ptp(seen[:, 1]) / camera.height)
        off.append(abs((seen[:, 0].max() + seen[:, 0].min()) / 2 - camera.width / 2) / camera.width)
    return np.array(sizes), np.array(off)


def test_a_figure_that_travels_stays_large_and_in_the_middle() -> None:
    sizes, off = _seen_sizes(walking(20.0), None)
    assert sizes.min() > 0.6
    assert off.max() < 0.2
    assert _seen_sizes(walking(20.0), False)[0].min() < 0.2


def test_a_figure_that_stays_is_not_followed() -> None:
    for speed, followed, moves in ((0.0, None, False), (0.5, None, False), (0.5, True, True), (20.0, None, True)):
        rows, _ = clips.build_strips(
            clips.of_document(walking(speed), [0], (), FrameSelection(count=2)), followed=followed
        )
        assert (rows[0].root_path is not None) == moves


def test_the_way_is_that_of_the_figure() -> None:
    times = np.linspace(0, 4, 48)
    positions = BODY + np.stack([3 * times, 0 * times, 4 * times], axis=1)[:, None]
    cache = from_arrays(times, positions, FACE)
    assert root_path.travels(cache)
    found = root_path.root_path(cache)
    assert found.at(2.0) == pytest.approx([6, 8], abs=1e-5)
    assert found.distance(np.array([0, 4])) == pytest.approx([0, 20], abs=1e-5)
    start = BODY[:, [0, 2]].mean(axis=0)
    assert found.milestones(1.0, 2.0) == pytest.approx(start + np.outer([0, 2, 4], [0.6, 0.8]), abs=1e-5)


def test_a_single_step_does_not_sway_the_camera() -> None:
    times = np.linspace(0, 4, 48)
    sway = 0.1 * np.sin(2 * np.pi * 4 * times)
    positions = BODY + np.stack([sway, 0 * times, 2 * times], axis=1)[:, None]
    places = root_path.root_path(from_arrays(times, positions, FACE)).places
    assert np.abs(places[:, 0]).max() < 0.06
    assert np.diff(places[:, 1]) == pytest.approx(2 * times[1], rel=1e-4)


def test_methods_of_one_clip_are_followed_alike() -> None:
    rows, _ = clips.build_strips(clips.of_document(walking(20.0), [0], ("lbs", "dqs"), FrameSelection(count=2)))
    assert rows[0].root_path is rows[1].root_path is not None


def test_the_ground_goes_by() -> None:
    rows, extent = clips.build_strips(clips.of_document(walking(20.0), [0], (), FrameSelection(at=(0.0, 1.0))))
    frames = filmstrip(
        [replace(rows[0], faces=FACE[:0], colors=rows[0].colors[:0])], extent, look=ViewOptions(height=64)
    )
    half = frames.shape[1] // 2
    assert np.abs(frames[12:76, 12 : half - 8].astype(int) - frames[12:76, half + 5 : -11][:, : half - 20]).max() > 20
