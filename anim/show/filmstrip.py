"""A motion as a filmstrip: one row for each clip or method, one camera for all, times under the frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anim.arrays import AnyArray, Floats, Ints
from anim.errors import RangeError
from anim.show import glyphs, heat
from anim.show.camera import AZIMUTH, ELEVATION, framed
from anim.show.stage import Stage, draw, encoded, stage

HEIGHT = 240  # pixels of a frame
GAP, EDGE = 3, 12  # pixels between frames, and around all
MAX_WIDTH = 1600  # pixels, beyond which frames go into another line
PAPER, INK, FAINT = (247, 247, 248), (56, 58, 62), (120, 123, 128)  # sRGB
LETTER = 2  # pixels of a dot of the font
LOW = 8 + 7 * LETTER  # pixels from the bottom of a frame to the top of words in it
BAR = 120, 8  # pixels of the heat's legend
MOST_POINTS = 2_000_000  # that the camera is framed on
CLOSED = 1e-3  # share of the way that vertices move; a loop ends this near its start
MOST_PIXELS = 500_000_000  # of all pictures together, which take 3 bytes each

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Row:
    """One strip. times: (F,) s. positions: (F, V, 3) m, Y up. faces: (T, 3). colors: (T, 3) linear.

    distances: (F, V) m, shown as heat instead of the colors where there are any. label: "dqs", "Walk".
    """

    label: str
    times: Floats
    positions: AnyArray
    faces: Ints
    colors: Floats
    distances: AnyArray | None = None


@dataclass(frozen=True, slots=True)
class Look:
    """height: pixels of a frame. azimuth, elevation: degrees of the camera around the motion."""

    height: int = HEIGHT
    azimuth: float = AZIMUTH
    elevation: float = ELEVATION


def filmstrip(rows: Sequence[Row], around: AnyArray, *, title: str = "", look: Look = Look()) -> Image:
    """Return the picture (H, W, 3) of all rows under each other; long ones go on in a next line.

    around: (P, 3) m, all places that the motion reaches: what the camera is framed on.
    Raises RangeError for pictures of less than 32 or more than 4096 pixels.
    """
    scenery = _scenery(around, look)
    width, height = scenery.camera.width, scenery.camera.height
    header, footer = _header_height(rows, title), glyphs.HEIGHT * LETTER + 2 * GAP
    count = max(len(row.times) for row in rows)
    lines = -(-count // max((MAX_WIDTH - 2 * EDGE) // (width + GAP), 1))
    columns = -(-count // lines)
    across = max(2 * EDGE + columns * (width + GAP) - GAP, _header_width(rows, title))
    sheet = _paper(header + lines * len(rows) * (height + footer) + EDGE - GAP, across)
    _write_header(sheet, rows, title)
    for r, row in enumerate(rows):
        for f, frame in enumerate(_frames(row, scenery, _most(rows))):
            top = header + (f // columns * len(rows) + r) * (height + footer)
            left = EDGE + f % columns * (width + GAP)
            sheet[top : top + height, left : left + width] = frame
            time = f"{row.times[f]:.2f} s"
            middle = left + (width - glyphs.width(time, size=LETTER)) // 2
            glyphs.write(sheet, time, middle, top + height + GAP, size=LETTER, color=FAINT)
            if row.label and f % columns == 0:
                glyphs.write(sheet, row.label, EDGE + 8, top + height - LOW, size=LETTER, color=INK)
    return sheet


def moving(rows: Sequence[Row], around: AnyArray, *, title: str = "", look: Look = Look()) -> Iterator[Image]:
    """Yield the pictures (H, W, 3) of an endless film, the rows side by side; the shorter ones wait for the longest.

    Raises RangeError for more pixels than memory should hold.
    """
    scenery = _scenery(around, look)
    width, height = scenery.camera.width, scenery.camera.height
    header = _header_height(rows, title)
    times = film_times(rows)
    frames = [_held(_frames(row, scenery, _most(rows))) for row in rows]
    across = max(2 * EDGE + len(rows) * (width + GAP) - GAP, _header_width(rows, title))
    _check_size(header + height + EDGE, across, len(times))
    for time, *pictures in zip(times, *frames, strict=False):
        sheet = _paper(header + height + EDGE, across)
        _write_header(sheet, rows, title)
        for r, picture in enumerate(pictures):
            left = EDGE + r * (width + GAP)
            sheet[header : header + height, left : left + width] = picture
            if rows[r].label:
                glyphs.write(sheet, rows[r].label, left + 8, header + height - LOW, size=LETTER, color=INK)
        said = f"{time:.2f} s"
        left = EDGE + width - 8 - glyphs.width(said, size=LETTER)
        glyphs.write(sheet, said, left, header + height - LOW, size=LETTER, color=FAINT)
        yield sheet


def film_times(rows: Sequence[Row]) -> Floats:
    """Return the times (F,) s of a film of the rows: of the longest; a loop's last frame, which is its first, is none.

    At least one row.
    """
    times = max((row.times for row in rows), key=len)
    return times[:-1] if _is_loop(rows) else times


def _held(frames: Iterator[Image]) -> Iterator[Image]:
    """The frames, and the last of them for good."""
    last = next(frames)
    yield last
    for last in frames:
        yield last
    while True:
        yield last


def _is_loop(rows: Sequence[Row]) -> bool:
    """Whether all rows end together, where they began, and are elsewhere between."""
    if len({len(row.times) for row in rows}) > 1:
        return False
    for row in rows:
        moved = [float(np.abs(each - row.positions[0]).max(initial=0)) for each in row.positions]
        if max(moved) == 0 or moved[-1] > CLOSED * max(moved):
            return False
    return True


def _paper(height: int, width: int) -> Image:
    _check_size(height, width, 1)
    return np.full((height, width, 3), PAPER, np.uint8)


def _check_size(height: int, width: int, frames: int) -> None:
    if height * width * frames > MOST_PIXELS:
        what = "the picture has" if frames == 1 else f"{frames} frames have"
        raise RangeError(
            f"{what} {width} × {height} pixels, too many (limit {MOST_PIXELS // 10**6} million together)",
            help="ask for fewer or smaller frames",
        )


def _scenery(around: AnyArray, look: Look) -> Stage:
    if not 32 <= look.height <= 4096:
        raise RangeError(f"frames are {look.height} pixels high (expected 32 … 4096)")
    points = np.asarray(around, np.float64).reshape(-1, 3)
    camera = framed(points, height=look.height, azimuth=look.azimuth, elevation=look.elevation)
    return stage(camera, points)


def _frames(row: Row, scenery: Stage, most: float) -> Iterator[Image]:
    for f, positions in enumerate(row.positions):
        colors = row.colors
        if row.distances is not None:
            colors = heat.of_faces(row.distances[f], row.faces, most)
        yield encoded(draw(scenery, positions.astype(np.float64), row.faces, colors))


def _most(rows: Sequence[Row]) -> float:
    return max((float(row.distances.max(initial=0)) for row in rows if row.distances is not None), default=0.0)


def _header_height(rows: Sequence[Row], title: str) -> int:
    return EDGE + (glyphs.HEIGHT * LETTER + GAP if title or _legend(rows) else 0)


def _header_width(rows: Sequence[Row], title: str) -> int:
    legend = _legend(rows)
    words = glyphs.width(title, size=LETTER) + (glyphs.width(legend, size=LETTER) + BAR[0] + 40 if legend else 0)
    return words + 2 * EDGE


def _legend(rows: Sequence[Row]) -> str:
    """What the heat's far end means, empty without heat."""
    return _length(_most(rows)) if any(row.distances is not None for row in rows) else ""


def _write_header(sheet: Image, rows: Sequence[Row], title: str) -> None:
    top = EDGE - GAP
    glyphs.write(sheet, title, EDGE, top, size=LETTER, color=INK)
    if legend := _legend(rows):
        left = sheet.shape[1] - EDGE - glyphs.width(legend, size=LETTER)
        glyphs.write(sheet, legend, left, top, size=LETTER, color=FAINT)
        width, height = BAR
        left -= width + 8
        sheet[top + 3 : top + 3 + height, left : left + width] = encoded(heat.colors(np.linspace(0, 1, width)))
        glyphs.write(sheet, "0", left - 8 - glyphs.width("0", size=LETTER), top, size=LETTER, color=FAINT)


def _length(meters: float) -> str:
    """A length in a unit that suits it, in ASCII."""
    for unit, factor in (("m", 1.0), ("cm", 1e2), ("mm", 1e3)):
        if meters * factor >= 1 or unit == "mm":
            return f"{meters * factor:.3g} {unit}"
    raise AssertionError
