"""Plot of collapse over time: index of linear blending, and volume by each method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from anim.arrays import Floats
from anim.show.plots.figure import (
    ACCENT,
    COLORS,
    HAIR,
    LINE,
    SMALL,
    SOFT,
    TITLE,
    Figure,
    annotate,
    separate_labels,
    style,
)
from anim.skinning.analysis.collapse import LOW_INDEX
from anim.skinning.analysis.recommendations import CollapseFinding

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LIMIT = 12  # clips on one sheet, the worst ones
COLUMN, WIDE = 5.2, 9.2  # inches: a cell of a grid, and one alone
MARGIN, LEFT, RIGHT, HEAD, CAPTION, FOOT = 0.2, 0.55, 0.55, 0.36, 0.3, 0.42
TOP, TALL = 0.62, 1.15
PADDING_FRACTION = 0.04  # of the scale, above and below


def collapse_plot(found: Sequence[CollapseFinding], *, title: str, kind: str) -> bytes:
    """Return a plot of the worst twelve clips as the bytes of a PNG or SVG file.

    Clips are in their own order; those of one frame are left out. Each: the least collapse index of its mesh over
    time, filled below 0.7; below it, for closed meshes, the enclosed volume by each method relative to bind pose. All
    clips and methods have one scale.
    Raises RangeError for another kind, UnsupportedError where matplotlib is not installed.
    """
    moving = [each for each in found if len(each.mesh.times) > 1] or list(found)
    worst = sorted(range(len(moving)), key=lambda i: moving[i].mesh.worst.index)[:LIMIT]
    shown = [moving[i] for i in sorted(worst)]
    with style(kind):
        columns = 1 if len(shown) < 2 else 2
        width = WIDE if columns == 1 else COLUMN
        rows = [shown[i : i + columns] for i in range(0, len(shown), columns)]
        height = HEAD + 2 * TALL + CAPTION + FOOT
        sheet = Figure(columns * width + 2 * MARGIN, TOP + len(rows) * height)
        sheet.text(MARGIN + 0.1, 0.33, title, fontsize=TITLE + 2, weight="bold")
        words = f"the worst {len(shown)} of {len(found)} clips" if len(found) > len(shown) else ""
        sheet.text(sheet.width - MARGIN - 0.1, 0.33, words, fontsize=SMALL, color=SOFT, ha="right")
        scale = _volume_range(shown)
        for r, row in enumerate(rows):
            for c, each in enumerate(row):
                _cell(sheet, each, MARGIN + c * width, TOP + r * height, width, scale)
        return sheet.render(kind)


def _cell(sheet: Figure, found: CollapseFinding, x: float, y: float, width: float, scale: tuple[float, float]) -> None:
    """One clip. scale: least and greatest volume of all clips, %."""
    mesh, left, across = found.mesh, x + LEFT, width - LEFT - RIGHT
    at = left + 0.14 + sheet.text(left, y + 0.2, found.clip, fontsize=TITLE, weight="bold")
    sheet.text(at, y + 0.2, f"{mesh.mesh}  ·  least collapse index, lbs", fontsize=SMALL, color=SOFT)
    axes = sheet.panel(left, y + HEAD, across, TALL)
    _draw_index(axes, mesh.times, mesh.indices)
    y += HEAD + TALL + CAPTION
    volumes = {each.method: each.volume for each in mesh.methods if each.volume is not None}
    words = "enclosed volume, % of bind pose" if volumes else "no part of the mesh is closed: no volume"
    sheet.text(left, y - 0.07, words, fontsize=SMALL, color=SOFT)
    if volumes:
        _draw_volumes(sheet.panel(left, y, across, TALL), mesh.times, volumes, scale)


def _draw_index(axes: Axes, times: Floats, indices: Floats) -> None:
    axes.set_ylim(-PADDING_FRACTION, 1 + PADDING_FRACTION)
    axes.set_yticks([0, 0.5, LOW_INDEX, 1])
    axes.axhline(LOW_INDEX, color=COLORS[0], linewidth=0.8, linestyle=(0, (4, 3)))
    axes.fill_between(
        times, indices, LOW_INDEX, where=indices < LOW_INDEX, interpolate=True, color=COLORS[0], alpha=0.25
    )
    axes.plot(times, indices, color=ACCENT, linewidth=LINE, marker="o" if len(times) == 1 else None)
    _fit(axes, times)
    axes.set_xticklabels([])


def _volume_range(found: Sequence[CollapseFinding]) -> tuple[float, float]:
    """Least and greatest volume of all clips and methods, % of bind pose."""
    volumes = [each.volume for one in found for each in one.mesh.methods if each.volume is not None]
    low = min((100 * float(each.min()) for each in volumes), default=100.0)
    high = max((100 * float(each.max()) for each in volumes), default=100.0)
    return min(low, 95.0), max(high, 101.0)


def _draw_volumes(axes: Axes, times: Floats, volumes: dict[str, Floats], scale: tuple[float, float]) -> None:
    low, high = scale
    room = PADDING_FRACTION * (high - low)
    axes.set_ylim(low - room, high + room)
    axes.axhline(100, color=HAIR, linewidth=0.8)
    ends = [100 * float(each[-1]) for each in volumes.values()]
    places = separate_labels(ends, (high - low) * 0.13, low, high)
    for i, (method, volume) in enumerate(volumes.items()):
        axes.plot(times, 100 * volume, color=COLORS[i], linewidth=LINE)
        annotate(
            axes, method, (1, places[i]), xycoords=("axes fraction", "data"), xytext=(5, 0), textcoords="offset points",
            va="center", fontsize=SMALL, color=COLORS[i], annotation_clip=False,
        )  # fmt: skip
    _fit(axes, times)
    style = {"fontsize": SMALL, "color": SOFT, "annotation_clip": False}
    axes.annotate("s", (1, 0), xycoords="axes fraction", xytext=(14, -5), textcoords="offset points", va="top", **style)


def _fit(axes: Axes, times: Floats) -> None:
    first, last = float(times[0]), float(times[-1])
    axes.set_xlim(first, last if last > first else first + 1)
