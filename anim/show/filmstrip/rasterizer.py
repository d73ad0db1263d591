"""Rasterization of triangles by a z-buffer in numpy, without GPU and driver."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np

from anim.arrays import Bools, Floats, Ints

MAX_BATCH_FACES = 1 << 18  # triangles set up at a time: 500 bytes each
MAX_BATCH_ROWS = 1 << 20  # rows of triangles drawn at a time
MAX_BATCH_PIXELS = 1 << 16  # pixels of these rows at a time: temporary arrays fit into the processor's cache
MAX_OVERDRAW = 32  # triangles per pixel, on average, above which equal ones are drawn once
EDGE_TOLERANCE_PX = 1e-9  # pixels; tolerance of the inside test, to avoid gaps between adjacent triangles
CHECKSUM_FACTORS = np.cumprod(np.full(9, 0x9E3779B97F4A7C15, np.uint64))  # odd ones: bits of a triangle's 9 numbers
MIN_AREA_PX2 = 1e-12  # pixels²; triangles of less area are seen edge-on

# (triangles (S,), columns (S,), rows (S,) of pixels) → whether each is drawn there (S,)
AlphaTest: TypeAlias = Callable[[Ints, Ints, Ints], Bools]


def visible_faces(
    corners: Floats, *, width: int, height: int, top: int = 0, alpha_test: AlphaTest | None = None
) -> Ints:
    """Return the index of the nearest triangle at each pixel (height, width) of the rows from `top` on, −1 for none.

    corners: (T, 3, 3): x and y in pixels from the top left, and nearness, which grows toward the eye and is linear on
    the screen (1 / distance). A triangle covers the pixels with their center inside. Both sides are visible.
    alpha_test: mask of the drawn pixels of triangles; None for all.
    Each triangle is split into rows, each row into the pixels between its edges.
    """
    seen: Ints = np.full(height * width, -1, np.int64)
    nearest = np.full(height * width, -np.inf)
    faces = _faces_in_rows(corners, top, top + height)
    if alpha_test is None and _area(corners, faces) > MAX_OVERDRAW * height * width:
        faces = faces[_last_of_equal(corners[faces])]
    for start in range(0, len(faces), MAX_BATCH_FACES):
        drawn = faces[start : start + MAX_BATCH_FACES]
        shares, near, chosen = _planes(corners[drawn])
        y = corners[drawn[chosen], :, 1]
        first = np.clip(np.ceil(y.min(axis=1) - 0.5), top, top + height).astype(np.int64)
        last = np.clip(np.floor(y.max(axis=1) - 0.5), top - 1, top + height - 1).astype(np.int64)
        rows = np.maximum(last - first + 1, 0)
        for some in _batches(rows, MAX_BATCH_ROWS):
            owner, line = _expand(first[some], rows[some])
            _draw(owner + some.start, line, shares, near, drawn[chosen], seen, nearest, width, top, alpha_test)
    return seen.reshape(height, width)


def _faces_in_rows(corners: Floats, top: int, bottom: int) -> Ints:
    """Indices, increasing, of triangles that reach into rows of pixels."""
    a, b, c = (corners[:, i, 1] for i in range(3))
    reaches_down = np.maximum(np.maximum(a, b), c) >= top
    return np.flatnonzero(reaches_down & (np.minimum(np.minimum(a, b), c) <= bottom))


def _area(corners: Floats, faces: Ints) -> float:
    """Sum of the areas of triangles, in pixels²."""
    return sum(_area_of(corners[faces[i : i + MAX_BATCH_FACES]]) for i in range(0, len(faces), MAX_BATCH_FACES))


def _area_of(corners: Floats) -> float:
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()) / 2


def _last_of_equal(corners: Floats) -> Ints:
    """Indices, increasing, of triangles that equal no later one: of equal ones the last is seen.

    They are found by a checksum, and all are kept where it is the same for different ones.
    """
    rows = np.ascontiguousarray(corners[::-1].reshape(len(corners), 9)).view(np.uint64)
    _, first, owner = np.unique(rows @ CHECKSUM_FACTORS, return_index=True, return_inverse=True)
    if not (rows == rows[first[owner]]).all():
        return np.arange(len(corners))
    return np.sort(len(corners) - 1 - first)


def _batches(counts: Ints, most: int) -> Iterator[slice]:
    """Slices of consecutive spans of at most so many elements in all, or of one span. counts: (S,), of each span."""
    ends = np.cumsum(counts)
    start = 0
    while start < len(counts):
        done = int(ends[start - 1]) if start else 0
        stop = max(int(np.searchsorted(ends, done + most, side="right")), start + 1)
        yield slice(start, stop)
        start = stop


def _expand(first: Ints, counts: Ints) -> tuple[Ints, Ints]:
    """Index of the span, and the element itself, of all elements of spans from `first` on."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, first[owner] + np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)


def _planes(corners: Floats) -> tuple[Floats, Floats, Ints]:
    """Coefficients of x, y and 1 for barycentric weights (T, 3, 3) and nearness (T, 3) of triangles."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    chosen: Ints = np.flatnonzero((np.abs(area) > MIN_AREA_PX2) & np.isfinite(corners).all(axis=(1, 2)))
    a, b, c, over = a[chosen], b[chosen], c[chosen], 1 / area[chosen]
    two = np.stack(((c[:, 1] - a[:, 1]) * over, (a[:, 0] - c[:, 0]) * over), axis=1)
    three = np.stack(((a[:, 1] - b[:, 1]) * over, (b[:, 0] - a[:, 0]) * over), axis=1)
    shares = np.empty((len(chosen), 3, 3))
    for i, slope in ((1, two), (2, three)):
        shares[:, i, :2] = slope
        shares[:, i, 2] = -(slope * a[:, :2]).sum(axis=1)
    shares[:, 0] = -shares[:, 1] - shares[:, 2]
    shares[:, 0, 2] += 1
    near = shares[:, 0] * a[:, 2, None] + shares[:, 1] * b[:, 2, None] + shares[:, 2] * c[:, 2, None]
    return shares, near, chosen


def _draw(
    which: Ints,
    line: Ints,
    shares: Floats,
    near: Floats,
    chosen: Ints,
    seen: Ints,
    nearest: Floats,
    width: int,
    top: int,
    alpha_test: AlphaTest | None,
) -> None:
    """Draw rows `line` of triangles `which`, each between its edges. seen: of the rows from `top` on."""
    low, high = np.full(len(which), -np.inf), np.full(len(which), np.inf)
    middle = line + 0.5
    for i in range(3):
        slope = shares[which, i, 0]
        rest = shares[which, i, 1] * middle + shares[which, i, 2]
        cut = -rest / np.where(slope == 0, 1.0, slope)
        low = np.where(slope > 0, np.maximum(low, cut), low)
        high = np.where(slope < 0, np.minimum(high, cut), high)
        high = np.where((slope == 0) & (rest < -EDGE_TOLERANCE_PX), -np.inf, high)
    first = np.clip(np.ceil(low - 0.5 - EDGE_TOLERANCE_PX), 0, width).astype(np.int64)
    last = np.clip(np.floor(high - 0.5 + EDGE_TOLERANCE_PX), -1, width - 1).astype(np.int64)
    counts = np.maximum(last - first + 1, 0)
    for some in _batches(counts, MAX_BATCH_PIXELS):
        these = which[some], line[some], first[some], counts[some]
        _draw_pixels(*these, near, chosen, seen, nearest, width, top, alpha_test)


def _draw_pixels(
    which: Ints,
    line: Ints,
    first: Ints,
    counts: Ints,
    near: Floats,
    chosen: Ints,
    seen: Ints,
    nearest: Floats,
    width: int,
    top: int,
    alpha_test: AlphaTest | None,
) -> None:
    """Draw `counts` pixels from column `first` on of rows `line` of triangles `which`."""
    row, x = _expand(first, counts)
    plane = near[which]
    level = plane[:, 1] * (line + 0.5) + plane[:, 2] + plane[:, 0] * 0.5
    depth = level[row] + plane[row, 0] * x
    pixel = ((line - top) * width)[row] + x
    if alpha_test is not None:
        drawn = alpha_test(chosen[which[row]], x, line[row])
        row, pixel, depth = row[drawn], pixel[drawn], depth[drawn]
    np.maximum.at(nearest, pixel, depth)
    won = depth == nearest[pixel]
    seen[pixel[won]] = chosen[which[row[won]]]
