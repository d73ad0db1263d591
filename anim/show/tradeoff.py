"""Bytes against error: the curve that a budget is chosen on."""

from __future__ import annotations

from collections.abc import Sequence

from anim.optimize.tradeoff import Sized
from anim.show.sheet import ACCENT, INK, SMALL, SOFT, TITLE, Sheet, style

WIDTH, HEIGHT = 7.0, 4.4  # inches
LEFT, RIGHT, TOP, BOTTOM = 0.8, 0.4, 0.8, 0.7


def tradeoff(sizes: Sequence[Sized], diagonal: float, *, title: str, kind: str) -> bytes:
    """Return a picture of sizes at bounds as the bytes of a PNG or SVG file: kB over % of the diagonal, logarithmic.

    Raises RangeError for another kind, UnsupportedError where matplotlib is not installed.
    """
    with style(kind):
        sheet = Sheet(WIDTH, HEIGHT)
        sheet.text(LEFT, 0.35, title, fontsize=TITLE + 2, weight="bold")
        sheet.text(LEFT, 0.58, "kB of the file over the bound, % of the diagonal", fontsize=SMALL, color=SOFT)
        axes = sheet.panel(LEFT, TOP, WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM)
        percents = [100 * each.max_error / diagonal for each in sizes]
        kilobytes = [each.size / 1000 for each in sizes]
        axes.set_xscale("log")
        axes.plot(percents, kilobytes, color=ACCENT, marker="o", markersize=4, linewidth=1.4)
        for percent, kilobyte in zip(percents, kilobytes, strict=True):
            axes.annotate(
                f"{kilobyte:.4g}", (percent, kilobyte), xytext=(0, 7), textcoords="offset points",
                ha="center", fontsize=SMALL, color=INK,
            )  # fmt: skip
        axes.set_ylim(0, 1.15 * max(kilobytes))
        axes.set_xticks(percents, [f"{percent:.2g}" for percent in percents])
        axes.minorticks_off()
        return sheet.render(kind)
