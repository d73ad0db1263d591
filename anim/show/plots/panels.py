"""Panels of one track: values with keys and handles, angle, speed, and the difference of two files."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from anim.arrays import Floats
from anim.model import Interpolation, Track, ValueKind
from anim.show.plots import panel_axes, polylines
from anim.show.plots.figure import (
    COLORS,
    HAIR,
    INK,
    LINE,
    PAPER,
    SMALL,
    SOFT,
    SPEED,
    annotate,
    format_number,
    separate_labels,
)
from anim.show.plots.panel_axes import ROUND_ANGLES
from anim.show.plots.polylines import Polyline
from anim.show.plots.rotations import (
    COMPONENTS,
    FROM_REST,
    NEAR_LOCK_DEG,
    RotationCurve,
    gimbal_distance_line,
)
from anim.show.plots.track_selection import MAX_COLORED, PlotTrack

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LABEL = 8.0  # points
BEHIND, PALE, THIN = 4.5, 0.25, 1.1  # width and opacity of a first file's lines, width of the second's
TOO_DENSE, DOTS, HANDLES, RIMS = 1.5, 11, 14, 30  # px between keys, least values for each kind of mark
MAX_RANGE_RATIO = 4.0  # times the widest range; values further apart are drawn relative to their first key
NAME_SPACING_PX = 12.5  # px between names of components
DEGREES = 180 / math.pi
UNITS = ((1e6, "µm", 1e-4), (1e3, "mm", 5e-2))  # factor, name, and the length in m below which it is used


def kinds(each: PlotTrack) -> list[str]:
    """Return the panels of a track, from top to bottom: names of DRAW."""
    names = ["value"]
    if each.track.kind is ValueKind.ROTATION:
        names.append("angle" if each.view in (FROM_REST, COMPONENTS) else "lock")
    if any(np.nan_to_num(line.values).any() for line in each.speeds):
        names.append("speed")
    if each.other is not None:
        names.append("difference")
    return names


def labels(each: PlotTrack) -> list[str]:
    """Return the names of the components drawn in color."""
    return [each.labels[c] for c in each.colored]


def _value(axes: Axes, each: PlotTrack) -> str:
    """Draw values: those of the second file over those of the first, with keys and handles of the topmost."""
    front = each.other or each.track
    curves = [curve for curve in (each.curve, each.other_curve) if curve is not None]
    top = curves[-1]
    origin = _origin(each, curves[0])
    if each.other is not None:
        _draw_lines(axes, each, curves[0].line, origin, linewidth=BEHIND, alpha=PALE)
    _draw_lines(axes, each, top.line, origin, linewidth=LINE if each.other is None else THIN)
    if top.risers is not None:
        _draw_lines(axes, each, top.risers, origin, linewidth=0.6, alpha=0.5)
    is_plain = front.interpolation is Interpolation.CUBICSPLINE and not each.is_in_degrees
    handles = is_plain and panel_axes.key_spacing(axes, each) >= HANDLES
    panel_axes.limit_values(axes, each, curves, origin, handles=handles)
    _mark_lock(axes, each)
    if handles:
        _handles(axes, each, front, origin)
    _keys(axes, each, front.times, top.keys - origin)
    _component_names(axes, each, top.keys[-1] - origin)
    return ", from its first key" if origin.any() else ""


def _angle(axes: Axes, each: PlotTrack) -> str:
    start = each.rest if each.is_in_degrees else each.track.values[0]
    _single(
        axes,
        [polylines.angle_line(track, start) for track in _tracks(each)],
        DEGREES,
        INK,
        steps=ROUND_ANGLES,
    )
    return "angle from rest, °" if each.is_in_degrees else "angle from the first key, °"


def _lock(axes: Axes, each: PlotTrack) -> str:
    """Draw the distance of an Euler order from gimbal lock, at most 90°, filled below 5°."""
    found = [gimbal_distance_line(track, order=each.view) for track in _tracks(each)]
    _plot_lines(axes, found, DEGREES, INK)
    axes.set_ylim(0, 90 * 1.08)
    axes.set_yticks([0, 45, 90])
    axes.axhspan(0, NEAR_LOCK_DEG, color=COLORS[0], alpha=0.3, linewidth=0)
    line = found[-1]
    at = int(np.nanargmin(line.values[:, 0]))
    least, time = float(line.values[at, 0]) * DEGREES, float(line.times[at])
    axes.plot(time, least, "o", color=COLORS[0], markersize=3.4, clip_on=False, zorder=3)
    return f"distance to gimbal lock of {each.view}: at least {format_number(least)}° at {format_number(time)} s"


def _speed(axes: Axes, each: PlotTrack) -> str:
    found = each.speeds
    factor, unit = _unit(each, max(float(np.nanmax(line.values)) for line in found if len(line.times)))
    _single(axes, found, factor, SPEED)
    if each.track.kind is ValueKind.ROTATION:
        return "angular speed, °/s"
    return f"speed, {unit}/s" if unit else "speed, per second"


def _difference(axes: Axes, each: PlotTrack) -> str:
    assert each.other is not None
    line = polylines.difference_line(each.track, each.other)
    at = int(line.values[:, 0].argmax())
    most = float(line.values[at, 0])
    factor, unit = _unit(each, most)
    _single(axes, [line], factor, COLORS[0])
    if most == 0:
        return "difference: none"
    axes.plot(line.times[at], most * factor, "o", color=COLORS[0], markersize=3.4, clip_on=False)
    unit = unit if unit in ("°", "") else f" {unit}"
    return f"difference: at most {format_number(most * factor)}{unit} at {format_number(float(line.times[at]))} s"


def _mark_lock(axes: Axes, each: PlotTrack) -> None:
    """Shade the times of Euler angles near gimbal lock, with a line at the nearest."""
    if not each.is_in_degrees or each.view == FROM_REST:
        return
    line = gimbal_distance_line(each.other or each.track, order=each.view)
    distance = np.nan_to_num(line.values[:, 0], nan=np.inf) * DEGREES
    is_near = np.concatenate(([False], distance < NEAR_LOCK_DEG, [False]))
    starts, ends = np.flatnonzero(is_near[1:] & ~is_near[:-1]), np.flatnonzero(is_near[:-1] & ~is_near[1:]) - 1
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        nearest = line.times[start + int(distance[start : end + 1].argmin())]
        axes.axvspan(line.times[start], line.times[end], color=COLORS[0], alpha=0.18, linewidth=0, zorder=0.5)
        axes.axvline(nearest, color=COLORS[0], linewidth=0.9, linestyle=(0, (3, 2)), zorder=0.6)
        axes.annotate(
            "lock", (nearest, 1), xycoords=("data", "axes fraction"), xytext=(0, 3), textcoords="offset points",
            ha="center", fontsize=SMALL, color=COLORS[0],
        )  # fmt: skip


DRAW: dict[str, Callable[[Axes, PlotTrack], str]] = {
    "value": _value,
    "angle": _angle,
    "lock": _lock,
    "speed": _speed,
    "difference": _difference,
}


def _tracks(each: PlotTrack) -> list[Track]:
    return [each.track] if each.other is None else [each.track, each.other]


def _color(each: PlotTrack, component: int) -> str:
    """Red, green and blue for rotations about x, y and z; else the next color for each component by range."""
    if each.is_in_degrees:
        is_twice = len({label[0] for label in each.labels}) < len(each.labels)
        return COLORS[component if is_twice else "xyz".index(each.labels[component].lower())]
    colored = each.colored
    return COLORS[colored.index(component)] if component in colored else HAIR


def _origin(each: PlotTrack, curve: RotationCurve) -> Floats:
    """Origin (C,) of the drawn values: 0, or the first key if curves are too far apart."""
    values = curve.keys
    width = float(np.ptp(values, axis=0).max())
    far = values.shape[1] <= MAX_COLORED and float(values.max() - values.min()) > MAX_RANGE_RATIO * width > 0
    return values[0] if far and each.track.kind is not ValueKind.ROTATION else np.zeros(values.shape[1])


def _unit(each: PlotTrack, most: float) -> tuple[float, str]:
    """Factor and name of a suitable unit for values up to `most`."""
    if each.track.kind is ValueKind.ROTATION:
        return DEGREES, "°"
    if each.track.path != "translation":
        return 1.0, ""
    return next(((factor, unit) for factor, unit, limit in UNITS if most < limit), (1.0, "m"))


def _draw_lines(axes: Axes, each: PlotTrack, line: Polyline, origin: Floats, **look: Any) -> None:
    """Draw components in ascending order of range, those in color over the others."""
    if not len(line.times):
        return
    colored = each.colored
    others = np.setdiff1d(np.arange(line.values.shape[1]), colored)
    if len(others):
        _draw_gray(axes, line.times, line.values[:, others] - origin[others])
    for c in sorted(colored, key=lambda c: float(np.ptp(np.nan_to_num(line.values[:, c])))):
        axes.plot(line.times, line.values[:, c] - origin[c], color=_color(each, c), **look)


def _draw_gray(axes: Axes, times: Floats, values: Floats) -> None:
    """Draw components (T, C) without a color of their own; a line each takes seconds for thousands."""
    from matplotlib.collections import LineCollection

    points = np.stack(np.broadcast_arrays(times[:, None], values), axis=-1)  # (T, C, 2)
    look = {"linewidths": 0.6, "alpha": 0.7, "zorder": 1.5, "capstyle": "round", "joinstyle": "round"}
    axes.add_collection(LineCollection(list(np.swapaxes(points, 0, 1)), colors=HAIR, **look))


def _handles(axes: Axes, each: PlotTrack, front: Track, origin: Floats) -> None:
    colored = each.colored
    times, values = polylines.handles(front)
    for c in colored:
        pieces = np.concatenate(np.split(values[:, :, c], 2), axis=1)  # both keys and both handles of every segment
        bent = np.tile(np.ptp(pieces, axis=1) > 0, 2)
        color, places = _color(each, c), values[bent, :, c] - origin[c]
        for t, v in zip(times[bent], places, strict=True):
            axes.plot(t, v, color=color, linewidth=0.7, alpha=0.55, zorder=2.5)
        ring = {"color": PAPER, "markeredgecolor": color, "markersize": 2.6, "markeredgewidth": 0.7, "zorder": 2.6}
        axes.plot(times[bent, 1], places[:, 1], "o", **ring)


def _keys(axes: Axes, each: PlotTrack, times: Floats, values: Floats) -> None:
    """Draw keys as dots, or as a row of fine ticks at the bottom if they are too dense."""
    spacing = panel_axes.key_spacing(axes, each)
    if spacing < DOTS:
        low, high = axes.get_ylim()
        if spacing >= TOO_DENSE:
            axes.vlines(times, low, low + 0.025 * (high - low), color=SOFT, linewidth=0.5, alpha=0.55)
        return
    colored = each.colored
    for c in colored:
        rim = 0.6 if spacing >= RIMS else 0.0  # closer ones would cut the line into dashes
        dot = {"color": _color(each, c), "markersize": 3.6, "markeredgecolor": PAPER, "markeredgewidth": rim}
        axes.plot(times, values[:, c], "o", zorder=3, clip_on=False, **dot)


def _component_names(axes: Axes, each: PlotTrack, last: Floats) -> None:
    """Write names of components at the right ends of their curves; of equal ones the first is on top."""
    colored = each.colored
    low, high = axes.get_ylim()
    gap = NAME_SPACING_PX / panel_axes.size(axes)[1] * (high - low)
    upwards = colored[::-1]
    places = separate_labels([float(last[c]) for c in upwards], gap, low + gap / 2, high - gap / 2)
    beside = {"xycoords": ("axes fraction", "data"), "xytext": (6, 0), "textcoords": "offset points", "va": "center"}
    for c, place in zip(upwards, places, strict=True):
        color = _color(each, c)
        annotate(axes, each.labels[c][:16], (1, place), color=color, fontsize=LABEL, **beside)
    rest = len(last) - len(colored)
    if rest:
        above = {"xycoords": "axes fraction", "xytext": (0, 4), "textcoords": "offset points", "ha": "right"}
        axes.annotate(f"+ {rest} more, gray", (1, 1), color=SOFT, fontsize=SMALL, **above)


def _single(
    axes: Axes, found: list[Polyline], factor: float, color: str, *, steps: Sequence[float] = panel_axes.ROUND
) -> None:
    """Draw one filled curve from 0, or two lines for a comparison."""
    from matplotlib.ticker import MaxNLocator

    found = [polylines.keep_extremes(line) for line in found]
    top = max((float(np.nanmax(line.values)) for line in found if len(line.times)), default=0.0) * factor
    axes.set_ylim(0, top * 1.08 if top > 0 else 1)
    axes.yaxis.set_major_locator(MaxNLocator(nbins=2, steps=list(steps)))
    panel_axes.plain(axes)
    _plot_lines(axes, found, factor, color)
    if len(found) == 1:
        axes.fill_between(found[0].times, found[0].values[:, 0] * factor, 0, color=color, alpha=0.08, linewidth=0)


def _plot_lines(axes: Axes, found: list[Polyline], factor: float, color: str) -> None:
    """Draw one line, or two for a comparison: the first one wide and pale behind the other."""
    for i, line in enumerate(map(polylines.keep_extremes, found)):
        is_behind = len(found) > 1 and i == 0
        style = {"linewidth": BEHIND - 1, "alpha": PALE} if is_behind else {"linewidth": THIN}
        axes.plot(line.times, line.values[:, 0] * factor, color=color, **style)
