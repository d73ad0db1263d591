"""Rate-distortion plot: animation bytes against error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from anim.optimization.rate_distortion import RatePoint
from anim.show.plots.figure import ACCENT, HAIR, INK, SMALL, SOFT, TITLE, Figure, format_number, separate_labels, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, HEIGHT = 8.4, 4.8  # inches
LEFT, RIGHT, TOP, BOTTOM = 0.75, 0.45, 1.05, 0.62
PADDING_PER_RANGE = 0.08  # of the logarithm of the bytes, on both sides
ABOVE = 0.13, 0.17  # inches from the panel to the lowest label above it, and between lines
MIN_LABEL_DISTANCE_IN = 1.5  # inches; labels of marks nearer than this are on different lines
TICKS = (1, 2, 3, 5)
MIN_LOG_RATIO = 4.0  # times the least value; axes of smaller range have evenly spaced ticks
UNITS = ((1e6, "MB"), (1e3, "kB"), (1, "B"))


def rate_distortion_plot(
    sizes: Sequence[RatePoint], diagonal: float, *, title: str, kind: str, source: int | None = None
) -> bytes:
    """Return a plot of error bounds, % of the diagonal, over animation bytes as a PNG or SVG file.

    Both axes are logarithmic. Vertical lines mark the source, the lossless size (a bound of 0), and the smallest size
    of any bound.
    source: animation bytes of the file before. Raises RangeError for another kind, UnsupportedError where matplotlib
    is not installed.
    """
    with style(kind):
        sheet = Figure(WIDTH, HEIGHT)
        sheet.text(LEFT, 0.35, title, fontsize=TITLE + 2, weight="bold")
        words = "error bound, % of the diagonal, over bytes of animation: keys and their JSON"
        sheet.text(LEFT, 0.58, words, fontsize=SMALL, color=SOFT)
        axes = sheet.panel(LEFT, TOP, WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM)
        lossy = [each for each in sizes if each.max_error > 0]
        marks = _marks(sizes, source)
        _scale(axes, [*(each.animation for each in lossy), *marks.values()])
        _draw(axes, lossy, diagonal)
        _draw_marks(sheet, axes, marks)
        return sheet.render(kind)


def _marks(sizes: Sequence[RatePoint], source: int | None) -> dict[str, int]:
    """Animation bytes by label."""
    marks = {} if source is None else {"source": source}
    without_loss = [each.animation for each in sizes if each.max_error == 0]
    if without_loss:
        marks["without loss"] = min(without_loss)
    marks["floor"] = min(each.animation for each in sizes)
    return marks


def _scale(axes: Axes, counts: Sequence[int]) -> None:
    """Set a logarithmic axis of bytes for all counts, with round ticks."""
    from matplotlib.ticker import MaxNLocator

    low, high = np.log10(max(min(counts), 1)), np.log10(max(max(counts), 1))
    room = max(PADDING_PER_RANGE * (high - low), 0.015)
    axes.set_xscale("log")
    axes.set_xlim(10 ** (low - room), 10 ** (high + room))
    first, last = axes.get_xlim()
    decades = range(int(np.floor(np.log10(first))), int(np.ceil(np.log10(last))) + 1)
    ticks = [step * 10.0**decade for decade in decades for step in TICKS]
    ticks = [tick for tick in ticks if first <= tick <= last]
    if last < MIN_LOG_RATIO * first:
        ticks = [tick for tick in MaxNLocator(7).tick_values(first, last) if first <= tick <= last]
    elif len(ticks) > 9:
        ticks = [tick for tick in ticks if f"{tick:e}"[0] in "1"]
    axes.set_xticks(ticks, [_bytes(tick) for tick in ticks])
    axes.tick_params(axis="x", which="major", length=4, width=0.6, color=SOFT)


def _draw(axes: Axes, sizes: Sequence[RatePoint], diagonal: float) -> None:
    percents = [100 * each.max_error / diagonal for each in sizes]
    counts = [each.animation for each in sizes]
    axes.set_yscale("log")
    axes.plot(counts, percents, color=ACCENT, marker="o", markersize=4, linewidth=1.4, clip_on=False)
    for percent, count in zip(percents, counts, strict=True):
        axes.annotate(
            _bytes(count), (count, percent), xytext=(7, 2), textcoords="offset points", fontsize=SMALL, color=INK,
            annotation_clip=False,
        )  # fmt: skip
    axes.set_yticks(percents, [f"{format_number(percent)} %" for percent in percents])
    axes.minorticks_off()


def _draw_marks(sheet: Figure, axes: Axes, marks: dict[str, int]) -> None:
    """Draw vertical lines with labels above them, on two lines if they are near each other."""
    first, last = np.log10(axes.get_xlim())
    width = WIDTH - LEFT - RIGHT
    names = list(marks)
    places = [LEFT + width * (np.log10(max(marks[name], 1)) - first) / (last - first) for name in names]
    words = separate_labels(
        places, MIN_LABEL_DISTANCE_IN, LEFT + MIN_LABEL_DISTANCE_IN / 2, WIDTH - RIGHT - MIN_LABEL_DISTANCE_IN / 2
    )
    for name, place, at in zip(names, places, words, strict=True):
        axes.axvline(marks[name], color=HAIR if name == "floor" else SOFT, linewidth=1, linestyle=(0, (4, 3)), zorder=1)
        sheet.line((place, at), (TOP, TOP - ABOVE[0] + 0.04), color=HAIR, linewidth=0.8)
        sheet.text(at, TOP - ABOVE[0], f"{name}  {_bytes(marks[name])}", fontsize=SMALL, color=INK, ha="center")


def _bytes(count: float) -> str:
    factor, unit = next(((factor, unit) for factor, unit in UNITS if count >= factor), UNITS[-1])
    return f"{format_number(count / factor)} {unit}"
