"""Plot of easings side by side: value, speed, and dots at even times."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from anim.arrays import Floats
from anim.curves.easing.function import Easing
from anim.curves.fitting.easing_fit import fit_segments
from anim.errors import RangeError
from anim.show.plots.figure import (
    ACCENT,
    COLORS,
    FAINT,
    HAIR,
    LINE,
    PAPER,
    SMALL,
    SOFT,
    SPEED,
    TITLE,
    Figure,
    format_number,
    style,
    text_width,
)
from anim.show.plots.panel_axes import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LIMIT = 24  # easings on one sheet
PER_ROW = 4
POINTS = 301
DOTS = 20  # steps of even time
MAX_SLOPE = 8.0  # slopes above are clipped: circ and vertical Béziers have infinite ones
TOLERANCE = 1e-3  # of the range, for the number of cubics

CELL, MARGIN, LEFT, RIGHT = 2.75, 0.25, 0.5, 0.2  # inches
TOP, HEAD, CURVE, SLOPE, TEMPO, CAPTION, FOOT = 0.15, 0.54, 2.05, 0.8, 0.3, 0.42, 0.3


def easing_plot(easings: Sequence[Easing], *, kind: str) -> bytes:
    """Return a plot of easings as the bytes of a PNG or SVG file, four per row, all to one scale.

    Each: f(t), its overshoot filled; f′(t), 1 being constant speed; and a row of dots at f of every twentieth of the
    time: dense for slow motion, sparse for fast. The line below the name gives its form in glTF: exact cubics, STEP
    keys, or the number of cubics within 0.1 %.
    Raises RangeError for none or over 24 easings or another kind, UnsupportedError where matplotlib is not installed.
    """
    if not 0 < len(easings) <= LIMIT:
        raise RangeError(f"{len(easings)} eases are to be drawn (expected 1 to {LIMIT})")
    with style(kind):
        rows = [easings[i : i + PER_ROW] for i in range(0, len(easings), PER_ROW)]
        height = HEAD + CURVE + CAPTION + SLOPE + CAPTION + TEMPO + FOOT
        sheet = Figure(len(rows[0]) * CELL + 2 * MARGIN, TOP + len(rows) * height)
        low = min(easing.extent[0] for easing in easings)
        high = max(easing.extent[1] for easing in easings)
        slopes = [_slopes(easing) for easing in easings]
        bottom = min(0.0, *(float(np.nanmin(each)) for each in slopes))
        top = max(1.6, *(float(np.nanmax(each)) for each in slopes))
        for i, easing in enumerate(easings):
            x, y = MARGIN + i % PER_ROW * CELL, TOP + i // PER_ROW * height
            cell = _Cell(sheet, easing, x, y, first=i % PER_ROW == 0)
            cell.draw((low, high), slopes[i], (bottom - 0.04 * (top - bottom), top * 1.04))
        return sheet.render(kind)


def _slopes(easing: Easing) -> Floats:
    """f′ (POINTS,), NaN at breakpoints, clipped at STEEPEST."""
    u = _grid(easing)
    slope = np.clip(easing.derivative(u), -MAX_SLOPE, MAX_SLOPE)
    slope[np.isin(u, _jumps(easing))] = np.nan
    return slope


def _grid(easing: Easing) -> Floats:
    """Time fractions of the drawn points: even ones, and both sides of every breakpoint."""
    breaks = np.array(easing.breakpoints)
    sides = np.concatenate((breaks - 1e-9, breaks, breaks + 1e-9))
    return np.sort(np.concatenate((np.linspace(0, 1, POINTS), sides)))


def _jumps(easing: Easing) -> list[float]:
    """Time fractions of jumps of the value."""
    pieces = easing.exact or ()
    inner = [b.start for a, b in pairwise(pieces) if a.value1 != b.value0]
    return inner + ([1.0] if pieces and pieces[-1].value1 != 1 else [])


class _Cell:
    def __init__(self, sheet: Figure, easing: Easing, x: float, y: float, *, first: bool) -> None:
        self.sheet, self.easing, self.first = sheet, easing, first
        self.x, self.y, self.across = x + LEFT, y, CELL - LEFT - RIGHT

    def draw(self, values: tuple[float, float], slopes: Floats, steep: tuple[float, float]) -> None:
        """Draw one easing; values, steep: ranges of the y axes of all easings on the sheet."""
        y = self.y
        size = min(TITLE, TITLE * (CELL - LEFT) / (text_width(self.easing.name, TITLE, "bold") + 0.1))
        self.sheet.text(self.x, y + 0.2, self.easing.name, fontsize=size, weight="bold")
        self.sheet.text(self.x, y + 0.38, _in_gltf(self.easing), fontsize=SMALL, color=SOFT)
        y += HEAD
        self._curve(self.sheet.panel(self.x, y, self.across, CURVE), values)
        y += CURVE + CAPTION
        peak = self._slope(self.sheet.panel(self.x, y, self.across, SLOPE), slopes, steep)
        self.sheet.text(self.x, y - 0.08, f"speed f′, {peak}", fontsize=SMALL, color=SOFT)
        y += SLOPE + CAPTION - 0.14
        self._tempo(self.sheet.panel(self.x, y, self.across, TEMPO), values)
        words = f"tempo: every 1/{DOTS} of the time" if self.first else "tempo"
        self.sheet.text(self.x, y - 0.02, words, fontsize=SMALL, color=SOFT)

    def _curve(self, axes: Axes, values: tuple[float, float]) -> None:
        u = _grid(self.easing)
        f = np.asarray(self.easing.value(u), np.float64)
        over, under = np.maximum(f, 1), np.minimum(f, 0)
        axes.fill_between(u, over, 1, color=COLORS[0], alpha=0.25, linewidth=0)
        axes.fill_between(u, under, 0, color=COLORS[0], alpha=0.25, linewidth=0)
        axes.plot((0, 1), (0, 1), color=HAIR, linewidth=0.7, zorder=1)
        broken = np.where(np.isin(u, _jumps(self.easing)), np.nan, f)
        axes.plot(u, broken, color=ACCENT, linewidth=LINE + 0.3, clip_on=False)
        jumps = _jumps(self.easing)
        for place in jumps:
            ends = self.easing.value(np.array([place - 1e-9, place]))
            axes.plot((place, place), ends, color=ACCENT, linewidth=0.6, alpha=0.5, clip_on=False)
        joints = np.array([place for place in self.easing.breakpoints if place not in jumps])
        ring = {"color": PAPER, "markeredgecolor": ACCENT, "markersize": 3.2, "markeredgewidth": 0.9}
        axes.plot(joints, self.easing.value(joints), "o", **ring)
        pad = 0.05 * (values[1] - values[0])
        axes.set_ylim(values[0] - pad, values[1] + pad)
        axes.set_xlim(0, 1)
        axes.set_yticks([0, 0.5, 1], ["0", "½", "1"])
        axes.set_xticks([0, 0.5, 1], ["0", "½", "1 time" if self.first else "1"])
        axes.spines["bottom"].set_visible(False)
        low, high = self.easing.extent
        if high > 1:
            _write_overshoot(axes, float(u[f.argmax()]), high, f"+{format_number(100 * (high - 1))} %", 4)
        if low < 0:
            _write_overshoot(axes, float(u[f.argmin()]), low, f"{format_number(100 * low)} %", -10)

    def _slope(self, axes: Axes, slopes: Floats, steep: tuple[float, float]) -> str:
        from matplotlib.ticker import MaxNLocator

        u = _grid(self.easing)
        axes.axhline(1, color=HAIR, linewidth=0.7, zorder=1)
        axes.plot(u, slopes, color=SPEED, linewidth=1.2, clip_on=False)
        axes.fill_between(u, slopes, 0, color=SPEED, alpha=0.08, linewidth=0)
        axes.set_ylim(*steep)
        axes.set_xlim(0, 1)
        axes.yaxis.set_major_locator(MaxNLocator(nbins=3, steps=[1, 2, 5, 10]))
        plain(axes)
        axes.tick_params(axis="x", labelbottom=False)
        axes.spines["bottom"].set_position(("data", 0))
        if _jumps(self.easing):
            return "only jumps" if self.easing.stepped else "and jumps"
        with np.errstate(all="ignore"):
            most = float(np.nanmax(np.abs(self.easing.derivative(u))))
        return f"at most {format_number(most)}×" if most < 1e3 else "vertical in places"

    def _tempo(self, axes: Axes, values: tuple[float, float]) -> None:
        """Draw dots on a line with marks at 0 and 1; values: the least and greatest of all easings."""
        places = self.easing.value(np.linspace(0, 1, DOTS + 1))
        axes.grid(visible=False)
        axes.spines["bottom"].set_visible(False)
        axes.plot((0, 1), (0, 0), color=FAINT, linewidth=5, solid_capstyle="round", zorder=1)
        axes.vlines((0, 1), -0.8, 0.8, color=SOFT, linewidth=0.8, clip_on=False, zorder=1.5)
        dot = {"markersize": 5.2, "alpha": 0.55, "markeredgewidth": 0}
        axes.plot(places, np.zeros(len(places)), "o", color=ACCENT, clip_on=False, **dot)
        axes.set_xlim(*values)
        axes.set_ylim(-1, 1)
        axes.set_xticks([0, 1], ["0", "1"])
        axes.tick_params(axis="x", length=0, pad=0)
        axes.set_yticks([])


def _write_overshoot(axes: Axes, u: float, value: float, words: str, points: int) -> None:
    """Write the size of an overshoot `points` above its top or below its bottom."""
    side = {"xytext": (0, points), "textcoords": "offset points", "ha": "center", "annotation_clip": False}
    axes.annotate(words, (u, value), color=COLORS[0], fontsize=SMALL, **side)


def _in_gltf(easing: Easing) -> str:
    if easing.stepped:
        return "exact as STEP keys"
    if easing.exact is not None:
        return f"exact as {len(easing.exact)} cubic{'s' if len(easing.exact) > 1 else ''}"
    return f"{len(fit_segments(easing, tolerance=TOLERANCE))} cubics within 0.1 %"
