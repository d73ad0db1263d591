"""Figure with panels, laid out in inches from its top left corner, and its bytes as PNG or SVG.

One style for all plots: ink on white, hairlines instead of boxes, labels next to their curves, and colors safe for
color-blind viewers (Okabe & Ito 2008), with the usual red, green, blue for x, y, z.
"""

from __future__ import annotations

import io
import logging
import unicodedata
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import RangeError, UnsupportedError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FORMATS = ("png", "svg")
INK, SOFT, HAIR, FAINT, PAPER = "#1f2328", "#6a737d", "#c9ced4", "#eceef1", "#ffffff"
COLORS = ("#d55e00", "#009e73", "#0072b2", "#cc79a7", "#e69f00", "#56b4e9", "#8a6d00", "#7a7f87")
ACCENT = "#0072b2"
SPEED = "#4b5563"
DPI = 110
TITLE, TEXT, SMALL = 10.0, 8.5, 7.5  # points
LINE = 1.5
POINTS = 72  # per inch

_STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Helvetica Neue", "Arial"],
    "font.size": TEXT,
    "text.color": INK,
    "text.hinting": "no_hinting",  # hinted strokes make bold letters uneven
    "axes.unicode_minus": True,
    "axes.linewidth": 0.6,
    "lines.solid_capstyle": "round",
    "lines.solid_joinstyle": "round",
    "svg.fonttype": "none",  # text stays text, searchable and sharp at any scale
    "svg.hashsalt": "gltf-anim",
    "path.simplify": True,
    "agg.path.chunksize": 0,
}
MAX_CHARACTERS = 300
UNDRAWABLE = frozenset({"Cc", "Cs", "Cn", "Zl", "Zp"})  # categories of control characters, surrogates, and breaks
INSTALL = "pip install 'gltf-anim[plot]'"


class Figure:
    """A figure of fixed size in inches; x and y count from its top left corner.

    offset: inches that are added to y, to draw one plot below another.
    """

    def __init__(self, width: float, height: float) -> None:
        from matplotlib.figure import Figure

        self.width, self.height, self.offset = width, height, 0.0
        self.figure = Figure(figsize=(width, height), dpi=DPI, facecolor=PAPER)

    def panel(self, x: float, y: float, width: float, height: float) -> Axes:
        """Return new axes with hairlines at the ticks of y only; its top left corner is at x, y."""
        rect = (x / self.width, 1 - (self.offset + y + height) / self.height, width / self.width, height / self.height)
        axes = self.figure.add_axes(rect)
        axes.set_facecolor("none")
        for side in ("top", "left", "right"):
            axes.spines[side].set_visible(False)
        axes.spines["bottom"].set_color(HAIR)
        axes.grid(axis="y", color=FAINT, linewidth=0.8)
        axes.set_axisbelow(True)
        axes.tick_params(axis="both", length=0, labelsize=SMALL, labelcolor=SOFT, color=HAIR, pad=4)
        return axes

    def text(self, x: float, y: float, words: str, **style: Any) -> float:
        """Write text with its first baseline at x, y, and return its width in inches."""
        style = {"fontsize": TEXT, "va": "baseline", "ha": "left", "parse_math": False, **style}
        words = plain_text(words)
        self.figure.text(x / self.width, 1 - (self.offset + y) / self.height, words, **style)
        return text_width(words, style["fontsize"], style.get("weight", "normal"))

    def line(self, x: Sequence[float], y: Sequence[float], **style: Any) -> None:
        """Draw a line through points of the sheet."""
        from matplotlib.lines import Line2D

        across = [each / self.width for each in x]
        down = [1 - (self.offset + each) / self.height for each in y]
        self.figure.add_artist(Line2D(across, down, **style))

    def render(self, kind: str) -> bytes:
        """Return the figure as a file with reproducible bytes: no date, no program version, fixed identifiers."""
        out = io.BytesIO()
        metadata = {"Software": None} if kind == "png" else {"Date": None, "Creator": None}
        self.figure.savefig(out, format=kind, dpi=DPI, metadata=metadata, facecolor=PAPER)
        return out.getvalue()


@contextmanager
def style(kind: str) -> Iterator[None]:
    """Set the style of all plots inside, independent of the user's matplotlibrc.

    kind: "png" or "svg", RangeError for another. Raises UnsupportedError where matplotlib is not installed.
    """
    if kind not in FORMATS:
        raise RangeError(f"`format` is '{kind}' (expected {' or '.join(FORMATS)})")
    try:
        logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it warns where the home folder can't be written
        import matplotlib
    except ImportError:
        raise UnsupportedError("pictures need matplotlib, which is not installed", help=INSTALL) from None
    defaults = {name: value for name, value in matplotlib.rcParamsDefault.items() if not name.startswith("backend")}
    with matplotlib.rc_context({**defaults, **_STYLE}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font", UserWarning)  # names in all scripts
        yield


def text_width(words: str, points: float, weight: str = "normal") -> float:
    """Return the width of a text in the style's font, in inches."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(weight=weight, size=points)
    width, _, _ = text_to_path.get_text_width_height_descent(plain_text(words), font, ismath=False)
    return float(width) / POINTS


def annotate(axes: Axes, words: str, at: tuple[float, float], **style: Any) -> None:
    """Write text at a point of axes; `$` stands for itself, as names may have it."""
    axes.annotate(plain_text(words), at, parse_math=False, **style)


def plain_text(words: str) -> str:
    """Return the start of a text that is wider than any figure, without characters that can't be drawn.

    A name of a file can have 100 000 characters, control characters, which XML forbids, and lone surrogates.
    """
    words = words if len(words) <= MAX_CHARACTERS else words[: MAX_CHARACTERS - 1] + "…"
    return "".join("�" if unicodedata.category(c) in UNDRAWABLE else c for c in words)


def format_number(number: float) -> str:
    """Return a number with three digits, without exponent: "0.0123", "12.3", "1230"."""
    return f"{float(f'{number:.3g}'):.12f}".rstrip("0").rstrip(".").replace("-", "−")


def time_labels(times: Sequence[float]) -> list[str]:
    """Return labels of ticks in seconds, the last with its unit, with as many decimals as keep them apart.

    time_labels([100, 100.25, 100.5]) → ["100", "100.25", "100.5 s"]
    """
    step = min(np.diff(times), default=max(map(abs, times), default=1.0))
    digits = next(n for n in range(13) if n == 12 or all(abs(round(t, n) - t) <= 1e-3 * step for t in times))
    labels = [f"{round(t, digits) + 0.0:.{digits}f}".replace("-", "−") for t in times]
    labels = [label.rstrip("0").rstrip(".") if "." in label else label for label in labels]
    return [*labels[:-1], *(f"{label} s" for label in labels[-1:])]


def edge_lines(points: Floats, edges: Ints) -> Floats:
    """Return both ends of every edge (E, 2) of points (P, 2), and NaN behind them (3 E, 2).

    As one line to draw: thousands of lines take seconds.
    """
    ends = np.full((len(edges), 3, 2), np.nan)
    ends[:, :2] = points[edges]
    return ends.reshape(-1, 2)


def separate_labels(places: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Return positions moved apart to distances of at least `gap`, within low … high if they fit.

    separate_labels([1, 1, 5], 2, 0, 9) → [0, 2, 5]
    """
    order = sorted(range(len(places)), key=lambda i: places[i])
    groups: list[list[float]] = []  # center of each group of touching labels, and their number
    for i in order:
        groups.append([places[i], 1])
        while True:
            middle, count = groups[-1]
            half = gap * (count - 1) / 2
            groups[-1][0] = middle = min(max(middle, low + half), max(high - half, low + half))
            if len(groups) == 1 or groups[-2][0] + gap * (groups[-2][1] - 1) / 2 + gap <= middle - half + 1e-9:
                break
            other = groups.pop(-2)
            total = other[1] + count
            groups[-1] = [(other[0] * other[1] + middle * count) / total, total]
    result = [0.0] * len(places)
    at = 0
    for middle, count in groups:
        for k in range(int(count)):
            result[order[at]] = middle + gap * (k - (count - 1) / 2)
            at += 1
    return result
