"""Axes of the panels of one track: times, limits of values, ticks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from anim.arrays import Floats
from anim.show.plots import polylines
from anim.show.plots.figure import HAIR, SOFT, time_labels
from anim.show.plots.rotations import RotationCurve
from anim.show.plots.track_selection import PlotTrack

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROUND, ROUND_ANGLES = (1.0, 2.0, 2.5, 5.0, 10.0), (1.0, 1.5, 3.0, 4.5, 9.0, 10.0)  # steps of ticks


def span(each: PlotTrack) -> tuple[float, float]:
    """Return the first and last drawn time, in seconds: those of the clip."""
    return (each.start, each.end) if each.end > each.start else (each.start - 0.5, each.start + 0.5)


def time_axis(axes: Axes, each: PlotTrack, *, labeled: bool) -> None:
    """Mark seconds below the last panel, with fine ticks for frames if they fit."""
    from matplotlib.ticker import FixedLocator, MaxNLocator

    low, high = span(each)
    width = size(axes)[0]
    axes.xaxis.set_major_locator(MaxNLocator(nbins=max(int(width / 80), 3), steps=list(ROUND)))
    axes.set_xlim(low, high)
    if not labeled:
        axes.tick_params(axis="x", labelbottom=False)
        return
    ticks = [t for t in axes.get_xticks() if low - 1e-9 <= t <= high + 1e-9]
    axes.set_xticks(ticks, time_labels(ticks))
    axes.tick_params(axis="x", which="major", length=4, width=0.6, color=SOFT)
    frames = (high - low) * each.fps if each.fps is not None else 0.0
    if each.fps is not None and 2 <= frames <= width / 3:
        axes.xaxis.set_minor_locator(FixedLocator((low + np.arange(int(frames + 1.001)) / each.fps).tolist()))
        axes.tick_params(axis="x", which="minor", length=2.2, width=0.5, color=HAIR)


def limit_values(
    axes: Axes, each: PlotTrack, curves: Sequence[RotationCurve], origin: Floats, *, handles: bool
) -> None:
    """Set the limits for all values, and for handles unless they would flatten the curve."""
    from matplotlib.ticker import MaxNLocator

    values = np.concatenate([part for curve in curves for part in (curve.line.values, curve.keys)]) - origin
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    size = max(high - low, 1e-4 * max(abs(low), abs(high)), 1e-6)
    if high - low < size:
        low, high = (low + high - size) / 2, (low + high + size) / 2
    if handles:
        tips = polylines.handles(each.other or each.track)[1][:, 1] - origin
        low, high = max(min(low, float(tips.min())), low - size / 2), min(max(high, float(tips.max())), high + size / 2)
    pad = 0.07 * (high - low)
    axes.set_ylim(low - pad, high + pad)
    steps = ROUND_ANGLES if each.is_in_degrees and high - low > 4 else ROUND
    axes.yaxis.set_major_locator(MaxNLocator(nbins=4, steps=list(steps)))
    plain(axes)


def plain(axes: Axes) -> None:
    """Label the ticks of y with the least number of decimals."""
    from matplotlib.ticker import FuncFormatter

    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _tick(value, axes)))


def _tick(value: float, axes: Axes) -> str:
    places = axes.get_yticks()
    step = float(places[1] - places[0]) if len(places) > 1 else 1.0
    digits = max(0, math.ceil(-math.log10(step) - 1e-9)) if step > 0 else 0
    digits += 1 if abs(step * 10**digits - round(step * 10**digits)) > 1e-6 else 0
    return f"{value + 0.0:.{digits}f}".replace("-", "−")


def size(axes: Axes) -> tuple[float, float]:
    """Return the width and height of a panel in pixels."""
    box = axes.get_window_extent()
    return float(box.width), float(box.height)


def key_spacing(axes: Axes, each: PlotTrack) -> float:
    """Return the mean interval between keys in pixels."""
    times = (each.other or each.track).times
    low, high = span(each)
    share = float(times[-1] - times[0]) / (high - low) if len(times) > 1 else 1.0
    return size(axes)[0] * share / max(len(times) - 1, 1)
