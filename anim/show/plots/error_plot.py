"""Plot of the error between two versions of clips over time, by joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from anim.arrays import Floats
from anim.measure.error.error_curve import ErrorCurve
from anim.show.plots.figure import (
    COLORS,
    HAIR,
    INK,
    SMALL,
    SOFT,
    TITLE,
    Figure,
    annotate,
    format_number,
    style,
    text_width,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LIMIT = 12  # clips on one sheet, the worst ones
COLUMN, WIDE = 5.4, 9.2  # inches: a cell of a grid, and one alone
MARGIN, LEFT, RIGHT, MOST_RIGHT, HEAD, FOOT = 0.2, 0.62, 0.3, 1.5, 0.36, 0.46
TOP, TALL = 0.62, 1.7
THIN = 1.1
TOP_PADDING_FRACTION = 0.06  # of the scale, above
NAME_SPACING = 0.12  # of the height, between names
MAX_NAME_LETTERS = 22  # letters of a joint's name; longer ones are cut to their end
MIN_ERROR_M = 1e-11  # smaller errors come from rounding
UNITS = ((1.0, 1.0, "m"), (1e-2, 1e2, "cm"), (1e-4, 1e3, "mm"), (0.0, 1e6, "µm"))  # least value in m, factor, name


def error_plot(
    profiles: Sequence[ErrorCurve], *, title: str, kind: str, limit: float | None = None, note: str = ""
) -> bytes:
    """Return a plot of the first twelve differing clips as the bytes of a PNG or SVG file.

    Each: the largest distance of any vertex over time, filled, and in color those of the worst joints' own vertices,
    with the names of the worst at the top.
    limit: m, drawn as a line. note: text for the head of the sheet.
    Raises RangeError for another kind, UnsupportedError where matplotlib is not installed.
    """
    shown = differing_curves(profiles)[:LIMIT]
    with style(kind):
        columns = 1 if len(shown) < 2 else 2
        width = WIDE if columns == 1 else COLUMN
        rows = [shown[i : i + columns] for i in range(0, len(shown), columns)]
        height = HEAD + TALL + FOOT
        sheet = Figure(columns * width + 2 * MARGIN, TOP + (len(rows) * height if rows else FOOT))
        sheet.text(MARGIN + 0.1, 0.33, title, fontsize=TITLE + 2, weight="bold")
        sheet.text(sheet.width - MARGIN - 0.1, 0.33, note, fontsize=SMALL, color=SOFT, ha="right")
        if not shown:
            sheet.text(MARGIN + 0.1, TOP + 0.15, "no difference", color=SOFT)
        for r, row in enumerate(rows):
            for c, each in enumerate(row):
                _cell(sheet, each, MARGIN + c * width, TOP + r * height, width, limit)
        return sheet.render(kind)


def differing_curves(profiles: Sequence[ErrorCurve]) -> list[ErrorCurve]:
    """Return the error curves that exceed rounding."""
    return [each for each in profiles if each.error.max(initial=0.0) >= MIN_ERROR_M]


def _cell(sheet: Figure, profile: ErrorCurve, x: float, y: float, width: float, limit: float | None) -> None:
    left = x + LEFT
    top = float(profile.error.max(initial=0.0))
    factor, unit = next((factor, unit) for least, factor, unit in UNITS if top >= least) if top else (1e3, "mm")
    at = left + 0.14 + sheet.text(left, y + 0.2, profile.name or "(no name)", fontsize=TITLE, weight="bold")
    sheet.text(
        at,
        y + 0.2,
        f"largest distance, {unit} over s  ·  max {format_number(top * factor)} {unit}",
        fontsize=SMALL,
        color=SOFT,
    )
    names = [_tail(course.joint) for course in profile.joints]
    right = min(max([RIGHT, *(text_width(name, SMALL) + 0.2 for name in names)]), MOST_RIGHT)
    axes = sheet.panel(left, y + HEAD, width - LEFT - right, TALL)
    _draw(axes, profile, names, factor, limit)


def _draw(axes: Axes, profile: ErrorCurve, names: Sequence[str], factor: float, limit: float | None) -> None:
    times, error = profile.times, factor * profile.error
    high = (1 + TOP_PADDING_FRACTION) * float(error.max(initial=0.0)) or 1.0
    axes.set_ylim(0, high)
    axes.set_xlim(*_span(times))
    axes.fill_between(times, error, color=HAIR, alpha=0.45, linewidth=0)
    axes.plot(times, error, color=INK, linewidth=0.8, marker="o" if len(times) == 1 else None)
    for i in reversed(range(len(profile.joints))):  # the worst is drawn last
        axes.plot(times, factor * profile.joints[i].error, color=COLORS[i], linewidth=THIN)
        annotate(
            axes, names[i], (1, 1 - i * NAME_SPACING), xycoords="axes fraction", xytext=(6, 0),
            textcoords="offset points", va="top", fontsize=SMALL, color=COLORS[i], annotation_clip=False,
        )  # fmt: skip
    if limit is not None and factor * limit <= high:
        axes.axhline(factor * limit, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))


def _span(times: Floats) -> tuple[float, float]:
    first, last = float(times[0]), float(times[-1])
    return first, last if last > first else first + 1


def _tail(name: str) -> str:
    return name if len(name) <= MAX_NAME_LETTERS else "…" + name[1 - MAX_NAME_LETTERS :]
