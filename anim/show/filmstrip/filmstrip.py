"""Filmstrip of motions: a row for each clip and method, one camera, times below the frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from anim.arrays import AnyArray, Floats, Ints, is_finite
from anim.errors import DataRangeError, RangeError
from anim.memory import MemoryBudget
from anim.show.filmstrip import captions, palette
from anim.show.filmstrip.background import SceneView, mark_spacing, setup_view, translate_view
from anim.show.filmstrip.camera import AZIMUTH, ELEVATION, Camera, fit_camera
from anim.show.filmstrip.captions import FAINT, LINE
from anim.show.filmstrip.renderer import Image, render_frame
from anim.show.filmstrip.root_path import RootPath
from anim.show.filmstrip.surface import Surface
from anim.show.filmstrip.surface_pattern import SurfaceMarks, checker, edges
from anim.units import plural

HEIGHT = 240  # pixels of a frame
GAP, EDGE = 3, 12  # pixels between frames, and around all
CLIP_SPACING_PX = 10  # pixels between clips
WIDEST_TIME = "00.00 s"
MAX_WIDTH = 1600  # pixels; frames beyond are wrapped into another line
BACKGROUND = (247, 247, 248)  # sRGB
TEXT_INSET_PX = 8  # pixels from the left of a frame to its text
TEXT_HEIGHT_PX = captions.LINE + 3  # pixels from the bottom of a frame to the top of its text
MAX_POINTS = 2_000_000  # for the framing of the camera
LOOP_TOLERANCE = 1e-3  # of the displacement of vertices; the greatest loop gap of a closed loop
SHEET_BYTES, ENCODED_BYTES = 3, 4  # of a pixel of a picture, and of the same in Pillow, which encodes it
FRAME_BYTES = 13  # of a pixel of a frame that is drawn: grid, shadow and colors


@dataclass(frozen=True, slots=True)
class Strip:
    """Row of a filmstrip. times: (F,) s. positions: (F, V, 3) m, Y up. faces, linear colors: (T, 3).

    distances: (F, V) m, shown as a heat map instead of the colors, or None. label: of the row, "dqs".
    heading: above all rows of one clip, "Walk". root_path: for a camera that follows the figure.
    rest: (V, 3) m, to which a checker is fixed. surface: materials; None for plain colors.
    clip: index of its clip; rows of one clip are consecutive.
    """

    label: str
    times: Floats
    positions: AnyArray
    faces: Ints
    colors: Floats
    distances: AnyArray | None = None
    heading: str = ""
    root_path: RootPath | None = None
    rest: AnyArray | None = None
    surface: Surface | None = None
    clip: int = 0


@dataclass(frozen=True, slots=True)
class Extent:
    """Extent of a motion. points: (P, 3) m, for the framing of the camera. ground: its height in m."""

    points: AnyArray
    ground: float


@dataclass(frozen=True, slots=True)
class ViewOptions:
    """Options of the view. height: pixels of a frame. azimuth, elevation: degrees of the camera.

    checker: squares fixed to the rest pose on the surface. wire: the edges of its triangles.
    """

    height: int = HEIGHT
    azimuth: float = AZIMUTH
    elevation: float = ELEVATION
    checker: bool = False
    wire: bool = False


def filmstrip(rows: Sequence[Strip], extent: Extent, *, title: str = "", look: ViewOptions = ViewOptions()) -> Image:
    """Return the picture (H, W, 3) of all rows, clip by clip; long rows are wrapped.

    Rows of one clip are wrapped together, so that methods can be compared at the same times.
    Raises RangeError for frames of less than 32 or more than 4096 pixels and for infinite positions, UnsupportedError
    for a picture beyond the limit of memory.
    """
    camera = _fit_camera(extent, look)
    width, height = camera.width, camera.height
    most, header = _max_extent(rows), _header_height(rows, title)
    clips = [list(each) for _, each in groupby(rows, key=lambda row: row.clip)]
    per_line, pitch = _grid(width)
    columns = max(_columns(row, per_line)[0] for row in rows)
    across = max(columns * pitch - GAP, _header_width(rows, title))
    headings = [captions.wrap_text(clip[0].heading, across) if clip[0].heading else [] for clip in clips]
    heights = [_clip_height(*each, per_line, height) for each in zip(clips, headings, strict=True)]
    tall = header + sum(heights) + EDGE - GAP
    wide = across + 2 * EDGE
    size = (SHEET_BYTES + ENCODED_BYTES) * tall * wide
    _check_memory(f"a picture of {wide} × {tall} pixels", size, camera)
    sheet = _blank_image(tall, wide)
    captions.write_header(sheet, title, _legend(rows), left=EDGE, top=EDGE - GAP)
    scenery = _setup_scene(extent, camera)
    top = header
    for clip, words, clip_height in zip(clips, headings, heights, strict=True):
        for i, line in enumerate(words):
            captions.write(sheet, line, EDGE, top + CLIP_SPACING_PX + i * LINE)
        begin = top + len(words) * LINE + (CLIP_SPACING_PX if words else 0)
        for r, row in enumerate(clip):
            _draw_row(sheet, row, _frames(row, scenery, most, look), begin, (r, len(clip)), per_line, (width, height))
        top += clip_height
    return sheet


def _clip_height(clip: Sequence[Strip], words: Sequence[str], per_line: int, height: int) -> int:
    """Pixels of all rows of a clip, below the lines of its heading."""
    lines = max(_columns(row, per_line)[1] for row in clip)
    heading = len(words) * LINE + CLIP_SPACING_PX if words else 0
    return heading + lines * len(clip) * (height + _footer(clip[0]))


def _grid(width: int) -> tuple[int, int]:
    """Greatest number of frames per line, and pixels from one to the next, wide enough for captions."""
    pitch = max(width, captions.width(WIDEST_TIME)) + GAP
    return max((MAX_WIDTH - 2 * EDGE) // pitch, 1), pitch


def _columns(row: Strip, per_line: int) -> tuple[int, int]:
    """Number of frames per line, about equal for all, and number of lines."""
    lines = -(-len(row.times) // per_line)
    return -(-len(row.times) // lines), lines


def _footer(row: Strip) -> int:
    return GAP + LINE * (1 if row.root_path is None else 2)


def _draw_row(
    sheet: Image,
    row: Strip,
    frames: Iterator[Image],
    top: int,
    index_and_count: tuple[int, int],
    per_line: int,
    size: tuple[int, int],
) -> None:
    """Draw the frames of a row below `top` pixels. index_and_count: of the row in its clip."""
    (r, count), (width, height) = index_and_count, size
    columns, pitch = _columns(row, per_line)[0], _grid(width)[1]
    for f, frame in enumerate(frames):
        y = top + (f // columns * count + r) * (height + _footer(row))
        x = EDGE + f % columns * pitch + (pitch - GAP - width) // 2
        sheet[y : y + height, x : x + width] = frame
        for i, words in enumerate(_frame_captions(row, f)):
            middle = x + (width - captions.width(words)) // 2
            captions.write(sheet, words, middle, y + height + GAP + i * LINE, color=FAINT)
        if row.label and f % columns == 0:
            captions.write(sheet, row.label, x + TEXT_INSET_PX, y + height - TEXT_HEIGHT_PX)


def _frame_captions(row: Strip, frame: int) -> list[str]:
    """Captions of a frame: time and, if the camera follows the figure, distance: "0.50 s", "1.2 m"."""
    time = f"{row.times[frame]:.2f} s"
    if row.root_path is None:
        return [time]
    return [time, f"{row.root_path.distance(row.times[frame : frame + 1])[0]:.1f} m"]


def animate_frames(
    rows: Sequence[Strip], extent: Extent, *, title: str = "", look: ViewOptions = ViewOptions()
) -> Iterator[Image]:
    """Yield the frames (H, W, 3) of a looped film, rows side by side; short ones repeat the last frame.

    Raises UnsupportedError for more than the limit of memory allows, as if all were kept.
    """
    camera = _fit_camera(extent, look)
    width, height = camera.width, camera.height
    per_line, pitch = _grid(width)
    names = [captions.wrap_text(" ".join(filter(None, (row.heading, row.label))), pitch - GAP) for row in rows]
    name_lines = max(len(lines) for lines in names) if any(lines != [""] for lines in names) else 0
    columns = min(len(rows), per_line)
    header, cell = _header_height(rows, title), name_lines * LINE + height + CLIP_SPACING_PX
    across = max(columns * pitch - GAP, _header_width(rows, title)) + 2 * EDGE
    tall = header + -(-len(rows) // columns) * cell - CLIP_SPACING_PX + LINE + EDGE
    times, most = film_times(rows), _max_extent(rows)
    size = ENCODED_BYTES * tall * across * len(times)
    _check_memory(f"{plural(len(times), 'frame')} of {across} × {tall} pixels", size, camera)
    scenery = _setup_scene(extent, camera)
    frames = [_repeat_last(_frames(row, scenery, most, look)) for row in rows]
    for time, *pictures in zip(times, *frames, strict=False):
        sheet = _blank_image(tall, across)
        captions.write_header(sheet, title, _legend(rows), left=EDGE, top=EDGE - GAP)
        for r, picture in enumerate(pictures):
            top, left = header + r // columns * cell, EDGE + r % columns * pitch
            for i, line in enumerate(names[r]):
                captions.write(sheet, line, left, top + i * LINE)
            top += name_lines * LINE
            sheet[top : top + height, left : left + width] = picture
        captions.write(sheet, f"{time:.2f} s", EDGE, tall - EDGE - LINE + 2 * GAP, color=FAINT)
        yield sheet


def film_times(rows: Sequence[Strip]) -> Floats:
    """Return the times (F,) s of a film of the rows: of the longest one, for loops without the last frame.

    At least one row.
    """
    times = max((row.times for row in rows), key=len)
    return times[:-1] if _is_loop(rows) else times


def _repeat_last(frames: Iterator[Image]) -> Iterator[Image]:
    """The frames, followed by endless repetitions of the last one."""
    last = next(frames)
    yield last
    for last in frames:
        yield last
    while True:
        yield last


def _is_loop(rows: Sequence[Strip]) -> bool:
    """Return whether all rows are moving closed loops of equal duration."""
    if len({len(row.times) for row in rows}) > 1:
        return False
    for row in rows:
        moved = [float(np.abs(each - row.positions[0]).max(initial=0)) for each in row.positions]
        if max(moved) == 0 or moved[-1] > LOOP_TOLERANCE * max(moved):
            return False
    return True


def _blank_image(height: int, width: int) -> Image:
    return np.full((height, width, 3), BACKGROUND, np.uint8)


def _check_memory(what: str, size: int, camera: Camera) -> None:
    """Raise UnsupportedError if pictures of `size` bytes, and a frame, take more memory than the limit."""
    help = "ask for fewer or smaller frames, or raise `memory_limit`"
    MemoryBudget(0).check(size + FRAME_BYTES * camera.width * camera.height, what, help=help)


def _fit_camera(extent: Extent, look: ViewOptions) -> Camera:
    if not 32 <= look.height <= 4096:
        raise RangeError(f"frames are {look.height} pixels high (expected 32 … 4096)")
    points = extent.points.reshape(-1, 3)
    if not is_finite(points):  # as float32 relative to a figure that the camera follows
        raise DataRangeError("moves too far for a camera that follows it (beyond float32)")
    return fit_camera(points, height=look.height, azimuth=look.azimuth, elevation=look.elevation)


def _setup_scene(extent: Extent, camera: Camera) -> SceneView:
    return setup_view(camera, extent.points.reshape(-1, 3), extent.ground)


def _frames(row: Strip, scenery: SceneView, most: float, look: ViewOptions) -> Iterator[Image]:
    marks = _marks(row, look)
    for f, positions in enumerate(row.positions):
        colors = row.colors
        if row.distances is not None:
            colors = palette.heat_colors(row.distances[f], row.faces, most)
        vertices, view = positions.astype(np.float64), scenery
        if row.root_path is not None:
            position = row.root_path.at(row.times[f])
            vertices[:, [0, 2]] -= position
            view = translate_view(scenery, position, row.root_path.milestones(row.times[f], mark_spacing(scenery)))
        yield render_frame(view, vertices, row.faces, colors, marks, row.surface, tinted=row.distances is None)


def _marks(row: Strip, look: ViewOptions) -> list[SurfaceMarks]:
    found: list[SurfaceMarks] = []
    if look.checker:
        found.append(checker(row.positions[0] if row.rest is None else row.rest, row.faces))
    if look.wire:
        found.append(edges)
    return found


def _max_extent(rows: Sequence[Strip]) -> float:
    return max((float(row.distances.max(initial=0)) for row in rows if row.distances is not None), default=0.0)


def _header_height(rows: Sequence[Strip], title: str) -> int:
    return EDGE + (LINE if title or _legend(rows) else 0)


def _header_width(rows: Sequence[Strip], title: str) -> int:
    return captions.header_width(title, _legend(rows))


def _legend(rows: Sequence[Strip]) -> str:
    """Legend of the greatest distance of the heat map, empty without one."""
    return captions.length(_max_extent(rows)) if any(row.distances is not None for row in rows) else ""
