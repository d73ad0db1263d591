"""Plot of tracks over time: values with keys and tangents, speed, rotation angle, a second file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from anim.show.plots import panel_axes, panels
from anim.show.plots.figure import INK, SMALL, SOFT, TITLE, Figure, format_number, style, text_width
from anim.show.plots.rotations import FROM_REST
from anim.show.plots.track_selection import PlotTrack

LIMIT = 12  # tracks on one sheet

COLUMN, WIDE = 5.2, 9.2  # inches: a cell of a grid, and one alone
MARGIN, LEFT, HEAD, CAPTION, FOOT = 0.2, 0.62, 0.36, 0.27, 0.5
RIGHT, MOST_RIGHT = 0.5, 1.3  # for the names of components, and its greatest value
TALL, LOW = 1.75, 0.72  # heights of the first panel and of the others
TOP, TOP_OF_TWO = 0.62, 0.84
WORDS = {"translation": "translation, m", "rotation": "rotation, quaternion", "scale": "scale, factor", "pointer": ""}


@dataclass(frozen=True, slots=True)
class Names:
    """Names of the two files of a comparison."""

    one: str
    other: str


def track_plot(
    shown: Sequence[PlotTrack], *, title: str, kind: str, names: Names | None = None, note: str = ""
) -> bytes:
    """Return a plot of tracks as the bytes of a PNG or SVG file.

    Each track has a panel of its values, with keys and CUBICSPLINE handles (Bézier points, a third of the way), and
    below it one of its speed. A rotation is drawn in degrees about the joint's axes from its rest pose, with the whole
    angle below; as Euler angles, with the distance to gimbal lock below; or as the components of its quaternion.
    Values far apart with small ranges are drawn relative to their first key. A matching track of a second file is
    drawn over the first, with their difference at the bottom. Ticks mark frames if their rate is known.

    title, note: text for the head of the sheet. names: of the files of a comparison.
    Raises RangeError for another kind, UnsupportedError where matplotlib is not installed.
    """
    with style(kind):
        columns = 1 if len(shown) == 1 else 2
        width = WIDE if columns == 1 else COLUMN
        rows = [shown[i : i + columns] for i in range(0, len(shown), columns)]
        heights = [max(_height(each) for each in row) for row in rows]
        y = TOP if names is None else TOP_OF_TWO
        sheet = Figure(columns * width + 2 * MARGIN, y + sum(heights))
        _head(sheet, shown, title, note, names)
        many = len({each.clip for each in shown}) > 1
        for row, height in zip(rows, heights, strict=True):
            for i, each in enumerate(row):
                _cell(sheet, each, MARGIN + i * width, y, width, height - _height(each), many_clips=many)
            y += height
        return sheet.render(kind)


def _head(sheet: Figure, shown: Sequence[PlotTrack], title: str, note: str, names: Names | None) -> None:
    x = MARGIN + 0.1
    sheet.text(x, 0.33, title, fontsize=TITLE + 2, weight="bold")
    rates = {each.fps for each in shown}
    fps = rates.pop() if len(rates) == 1 else None
    words = [note, f"fine ticks: frames at {format_number(fps)} fps" if fps else ""]
    line = "  ·  ".join(word for word in words if word)
    sheet.text(sheet.width - MARGIN - 0.1, 0.33, line, fontsize=SMALL, color=SOFT, ha="right")
    if names is not None:
        sheet.line((x, x + 0.35), (0.535, 0.535), color=INK, linewidth=panels.BEHIND, alpha=panels.PALE)
        x += 0.45
        x += sheet.text(x, 0.57, names.one, fontsize=SMALL) + 0.35
        sheet.line((x, x + 0.35), (0.535, 0.535), color=INK, linewidth=panels.THIN)
        sheet.text(x + 0.45, 0.57, names.other, fontsize=SMALL)


def _height(each: PlotTrack) -> float:
    count = len(panels.kinds(each))
    return HEAD + TALL + (LOW + CAPTION) * (count - 1) + FOOT


def _cell(sheet: Figure, each: PlotTrack, x: float, y: float, width: float, slack: float, *, many_clips: bool) -> None:
    """Draw one track. slack: inches added to the first panel, for the height of its neighbor."""
    left = x + LEFT
    names = max(text_width(label, panels.LABEL) for label in panels.labels(each))
    across = width - LEFT - min(max(RIGHT, names + 0.2), MOST_RIGHT)
    at = y + HEAD
    kinds = panels.kinds(each)
    for i, kind in enumerate(kinds):
        tall = LOW if i else TALL + slack
        axes = sheet.panel(left, at, across, tall)
        axes.set_xlim(*panel_axes.span(each))
        caption = panels.DRAW[kind](axes, each)
        if i:
            sheet.text(left, at - 0.07, caption, fontsize=SMALL, color=SOFT)
        else:
            _title(sheet, each, (left, y + 0.2, width - LEFT), caption, many_clips=many_clips)
        panel_axes.time_axis(axes, each, labeled=i == len(kinds) - 1)
        at += tall + CAPTION


def _title(
    sheet: Figure, each: PlotTrack, place: tuple[float, float, float], caption: str, *, many_clips: bool
) -> None:
    """Write the target in bold, and what is drawn. place: x, y and width of both."""
    x, y, width = place
    words = [_quantity(each) + caption, _keys(each)]
    if many_clips:
        words.insert(0, _tail(each.clip, 24))
    line = "  ·  ".join(word for word in words if word)
    available = width - 0.14 - text_width(line, SMALL)
    tails = [_tail(each.target, most) for most in range(36, 4, -1)]
    name = next((tail for tail in tails if text_width(tail, TITLE, "bold") <= available), tails[-1])
    x += 0.14 + sheet.text(x, y, name, fontsize=TITLE, weight="bold")
    sheet.text(x, y, line, fontsize=SMALL, color=SOFT)


def _quantity(each: PlotTrack) -> str:
    """Quantity and unit of the values: "rotation from rest, °", "Euler angles ZXY, °", "scale, factor"."""
    if not each.is_in_degrees:
        return WORDS.get(each.track.path, each.track.path)
    return "rotation from rest, °" if each.view == FROM_REST else f"Euler angles {each.view}, °"


def _keys(each: PlotTrack) -> str:
    """Interpolation and number of keys, "linear, 48 keys", of two files "linear, 48 → 21 keys"."""
    how, count = str(each.track.interpolation).lower(), f"{len(each.track.times)}"
    if each.other is not None:
        other, more = str(each.other.interpolation).lower(), f"{len(each.other.times)}"
        how = how if how == other else f"{how} → {other}"
        count = count if count == more else f"{count} → {more}"
    return f"{how}, {count} key{'s' * (count != '1')}"


def _tail(name: str, most: int) -> str:
    """The end of a long name, from a slash if there is one."""
    if len(name) <= most:
        return name
    end = name[1 - most :]
    return "…" + end[max(end.find("/"), 0) :]
