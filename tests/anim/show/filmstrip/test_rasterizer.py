"""Rasterization in batches: memory does not grow with the number of triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.arrays import Ints
from anim.show.filmstrip import rasterizer


def test_batches_of_pixels_draw_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Triangles over most of the picture, some equal: the last one of equals is seen, whatever the batches."""
    random = np.random.default_rng(4)
    some = random.uniform(0, 40, (30, 3, 3))
    corners = np.concatenate((some, some[::2]))
    expected = rasterizer.visible_faces(corners, width=40, height=30)
    sizes: list[int] = []
    draw = rasterizer._draw_pixels

    def called(which: Ints, line: Ints, first: Ints, counts: Ints, *more: Any) -> None:
        sizes.append(int(counts.sum()))
        draw(which, line, first, counts, *more)

    monkeypatch.setattr(rasterizer, "_draw_pixels", called)
    monkeypatch.setattr(rasterizer, "MAX_BATCH_PIXELS", 100)
    monkeypatch.setattr(rasterizer, "MAX_BATCH_FACES", 7)
    found = rasterizer.visible_faces(corners, width=40, height=30)
    assert np.array_equal(found, expected)
    assert max(sizes) <= 100 < sum(sizes)


def test_rows_of_a_picture_are_those_of_the_whole() -> None:
    corners = np.random.default_rng(7).uniform(-5, 40, (60, 3, 3))
    corners[::9, 2, 1] = np.nan
    whole = rasterizer.visible_faces(corners, width=40, height=30)
    assert (whole >= 0).any()
    for height in (1, 4):
        bands = [rasterizer.visible_faces(corners, width=40, height=height, top=top) for top in range(0, 30, height)]
        assert np.array_equal(np.concatenate(bands)[:30], whole)


def test_equal_triangles_are_drawn_once_where_they_are_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """As sticks of nodes at one place: 200 times the picture's area takes that of three triangles."""
    random = np.random.default_rng(5)
    some = random.uniform(0, 40, (3, 3, 3))
    corners = np.tile(some, (200, 1, 1))
    counts: list[int] = []
    draw = rasterizer._draw_pixels

    def called(which: Ints, line: Ints, first: Ints, pixels: Ints, *more: Any) -> None:
        counts.append(int(pixels.sum()))
        draw(which, line, first, pixels, *more)

    monkeypatch.setattr(rasterizer, "_draw_pixels", called)
    found = rasterizer.visible_faces(corners, width=40, height=30)
    assert sum(counts) <= 3 * 40 * 30
    assert set(np.unique(found)) <= {-1, 597, 598, 599}
    monkeypatch.setattr(rasterizer, "MAX_OVERDRAW", 10**6)
    assert np.array_equal(found, rasterizer.visible_faces(corners, width=40, height=30))


def test_different_triangles_with_one_checksum_are_all_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    corners = np.random.default_rng(6).uniform(0, 40, (3, 3, 3))[[0, 1, 0, 2]]
    assert rasterizer._last_of_equal(corners).tolist() == [1, 2, 3]
    monkeypatch.setattr(rasterizer, "CHECKSUM_FACTORS", np.zeros(9, np.uint64))
    assert rasterizer._last_of_equal(corners).tolist() == [0, 1, 2, 3]
