"""Plot of curves by several tangent rules: overshoot, velocity, acceleration, continuity."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from anim import arrays
from anim.arrays import Floats
from anim.curves.tangents import table
from anim.errors import RangeError, ShapeError
from anim.maths import hermite
from anim.measure.continuity.continuity import ContinuityClass, KeyJumps, at_keys
from anim.model import Interpolation, Track
from anim.show.plots.figure import (
    COLORS,
    FAINT,
    INK,
    PAPER,
    SMALL,
    SOFT,
    TEXT,
    TITLE,
    Figure,
    format_number,
    style,
    time_labels,
)
from anim.show.plots.panel_axes import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LIMIT = 6  # rules in one plot, the number of distinguishable colors
SEGMENT_POINTS = 129  # points of one segment
EXTREMUM_POINTS = 2049  # points of one segment in the search for its extremum
LENS_FRACTION = 0.04  # of the range; smaller overshoots are also shown magnified
OVERSHOOT_TOLERANCE = 1e-6  # of the range; smaller overshoots are rounding
WITHOUT_RULE = {"linear": Interpolation.LINEAR, "step": Interpolation.STEP}

CURVE, SPEED, ACROSS = 2.9, 0.85, 6.1  # inches
MARGIN, LEFT, TOP, CAPTION, FOOT, WORDS = 0.25, 0.55, 0.62, 0.32, 0.45, 2.75
ENTRY = 0.56


def tangent_plot(times: ArrayLike, values: ArrayLike, rules: Sequence[str], *, kind: str) -> bytes:
    """Return a plot of curves through keys by tangent rules, as the bytes of a PNG or SVG file.

    Curve, velocity and acceleration of all rules are drawn in common panels; values outside the range of the two
    neighboring keys are filled. The legend lists continuity at keys and overshoot of each rule.

    times: (K,) s, increasing. values: (K,), K ≥ 2. rules: names as in TANGENTS, or "linear", "step"; at most six.
    Raises RangeError for unknown rules, too many or another kind, ShapeError for arrays that are not valid keys,
    UnsupportedError where matplotlib is not installed.
    """
    if not 0 < len(rules) <= LIMIT:
        raise RangeError(f"{len(rules)} tangent rules are to be drawn (expected 1 to {LIMIT})")
    t, v = arrays.as_key_times(times), arrays.as_floats(values, "K", name="values")
    if len(t) != len(v) or len(v) < 2:
        raise ShapeError(f"{len(v)} values for {len(t)} times (expected as many, and at least two)")
    curves = [_curve(t, v, rule) for rule in rules]
    with style(kind):
        height = TOP + CURVE + 2 * (SPEED + CAPTION) + FOOT
        sheet = Figure(MARGIN + LEFT + ACROSS + 0.35 + WORDS, height)
        x, y = MARGIN + LEFT, TOP
        listed = ", ".join(format_number(float(each)) for each in v[:12]) + (", …" if len(v) > 12 else "")
        sheet.text(MARGIN + 0.05, 0.33, f"Through {listed}", fontsize=TITLE + 2, weight="bold")
        _values(sheet.panel(x, y, ACROSS, CURVE), curves, t, v)
        y += CURVE + CAPTION
        sheet.text(x, y - 0.08, "velocity, per second", fontsize=SMALL, color=SOFT)
        _rates(sheet.panel(x, y, ACROSS, SPEED), curves, 1)
        y += SPEED + CAPTION
        sheet.text(x, y - 0.08, "acceleration, per second²", fontsize=SMALL, color=SOFT)
        axes = sheet.panel(x, y, ACROSS, SPEED)
        _rates(axes, curves, 2)
        _seconds(axes, t)
        for i, curve in enumerate(curves):
            _entry(sheet, curve, COLORS[i], x + ACROSS + 0.35, TOP + 0.12 + i * ENTRY)
        widest = max(curves, key=lambda curve: abs(curve.worst))
        if 0 < abs(widest.worst) < LENS_FRACTION * float(np.ptp(v)):
            _lens(sheet, curves, widest, x + ACROSS + 0.85, TOP + ENTRY * len(curves) + 0.25)
        return sheet.render(kind)


@dataclass(frozen=True, slots=True)
class _Curve:
    """One rule's curve: points (P,) s and (P, 3) value, velocity, acceleration, NaN between segments.

    bounds: (P,) the value, clamped to the range of the two neighboring keys. worst: the greatest distance from that
    range, signed. departure: greatest distance from a key. jumps: at the keys.
    """

    name: str
    track: Track
    times: Floats
    points: Floats
    bounds: Floats
    worst: float
    departure: float
    jumps: KeyJumps


def _curve(times: Floats, values: Floats, name: str) -> _Curve:
    track, departure = _track(times, values, name)
    k = np.repeat(np.arange(len(times) - 1), SEGMENT_POINTS)
    u = np.tile(np.linspace(0, 1, SEGMENT_POINTS), len(times) - 1)
    points = _points(track, k, u)
    low, high = np.minimum(values[k], values[k + 1]), np.maximum(values[k], values[k + 1])
    bounds = np.clip(points[:, 0], low, high)
    worst = _find_overshoot(track, values)
    at = times[k] + u * (times[k + 1] - times[k])
    return _Curve(
        track_name(name),
        track,
        _insert_breaks(at),
        _insert_breaks(points),
        _insert_breaks(bounds),
        worst,
        departure,
        at_keys(track),
    )


def _find_overshoot(track: Track, values: Floats) -> float:
    """Greatest distance from the range of the two neighboring keys, signed; 0 for rounding errors."""
    k = np.repeat(np.arange(len(values) - 1), EXTREMUM_POINTS)
    found = _points(track, k, np.tile(np.linspace(0, 1, EXTREMUM_POINTS), len(values) - 1))[:, 0]
    off = found - np.clip(found, np.minimum(values[k], values[k + 1]), np.maximum(values[k], values[k + 1]))
    worst = float(off[np.abs(off).argmax()])
    return worst if abs(worst) > OVERSHOOT_TOLERANCE * float(np.ptp(values)) else 0.0


def track_name(name: str) -> str:
    """Return the name of a rule with its parsed arguments."""
    return name if name in WITHOUT_RULE else table.parse(name).name


def _track(times: Floats, values: Floats, name: str) -> tuple[Track, float]:
    column = values[:, None]
    if name in WITHOUT_RULE:
        return Track(0, "weights", WITHOUT_RULE[name], times, column), 0.0
    keys = table.apply_tangents(times, column, table.parse(name))
    cubic = Interpolation.CUBICSPLINE
    return Track(0, "weights", cubic, times, keys.values, keys.in_tangents, keys.out_tangents), keys.departure


def _points(track: Track, k: arrays.Ints, u: Floats) -> Floats:
    """Value, velocity and acceleration (P, 3) at u (P,) of the segments k (P,), one-sided at their ends."""
    start, end = track.values[k, 0], track.values[k + 1, 0]
    h = track.times[k + 1] - track.times[k]
    none = np.zeros(len(k))
    if track.interpolation is Interpolation.STEP:
        return np.stack((start, none, none), axis=1)
    if track.in_tangents is None or track.out_tangents is None:
        return np.stack((start + u * (end - start), (end - start) / h, none), axis=1)
    piece = start, h * track.out_tangents[k, 0], end, h * track.in_tangents[k + 1, 0]
    value, velocity = hermite.evaluate(u, *piece), hermite.first_derivative(u, *piece) / h
    return np.stack((value, velocity, hermite.second_derivative(u, *piece) / h**2), axis=1)


def _insert_breaks(points: Floats) -> Floats:
    """Points (P, ...) with a NaN after every segment."""
    pieces = points.reshape(-1, SEGMENT_POINTS, *points.shape[1:])
    gap = np.full((len(pieces), 1, *points.shape[1:]), np.nan)
    return np.concatenate((pieces, gap), axis=1).reshape(-1, *points.shape[1:])


def _values(axes: Axes, curves: Sequence[_Curve], times: Floats, values: Floats) -> None:
    from matplotlib.ticker import MaxNLocator

    for i, curve in enumerate(curves):
        value = curve.points[:, 0]
        axes.fill_between(curve.times, value, curve.bounds, color=COLORS[i], alpha=0.22, linewidth=0)
        axes.plot(curve.times, value, color=COLORS[i], linewidth=1.7, zorder=2.2)
    axes.plot(
        times, values, "o", color=INK, markersize=5, markeredgecolor=PAPER, markeredgewidth=1, zorder=4, clip_on=False
    )
    every = np.concatenate([curve.points[:, 0] for curve in curves] + [values])
    low, high = float(np.nanmin(every)), float(np.nanmax(every))
    pad = 0.1 * (high - low) or 0.5
    axes.set_ylim(low - pad, high + pad)
    axes.yaxis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 2.5, 5, 10]))
    plain(axes)
    _seconds(axes, times)
    axes.tick_params(axis="x", labelbottom=False)
    side = {"textcoords": "offset points", "ha": "center", "color": INK, "fontsize": SMALL}
    if len(times) <= 12:
        for k in range(len(times)):
            around = values[max(k - 1, 0) : k + 2]
            up = values[k] >= around.mean()
            axes.annotate(format_number(float(values[k])), (times[k], values[k]), xytext=(0, 8 if up else -14), **side)


def _rates(axes: Axes, curves: Sequence[_Curve], which: int) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.axhline(0, color=SOFT, linewidth=0.6, zorder=1)
    axes.spines["bottom"].set_visible(False)
    for i, curve in enumerate(curves):
        axes.plot(curve.times, curve.points[:, which], color=COLORS[i], linewidth=1.2)
    every = np.concatenate([curve.points[:, which] for curve in curves])
    low, high = min(float(np.nanmin(every)), 0.0), max(float(np.nanmax(every)), 0.0)
    pad = 0.08 * (high - low) or 0.5
    axes.set_ylim(low - pad, high + pad)
    axes.yaxis.set_major_locator(MaxNLocator(nbins=3, steps=[1, 2, 2.5, 5, 10]))
    plain(axes)
    _seconds(axes, curves[0].track.times)
    axes.tick_params(axis="x", labelbottom=False)


def _seconds(axes: Axes, times: Floats) -> None:
    ticks = times if len(times) <= 12 else np.linspace(times[0], times[-1], 6)
    axes.set_xticks(ticks.tolist(), time_labels(ticks.tolist()))
    axes.set_xlim(float(times[0]), float(times[-1]))
    axes.grid(axis="x", color=FAINT, linewidth=0.8)
    axes.tick_params(axis="x", labelbottom=True)


def _entry(sheet: Figure, curve: _Curve, color: str, x: float, y: float) -> None:
    """Write the legend entry of a rule: name, continuity, overshoot."""
    sheet.line((x, x + 0.22), (y - 0.045, y - 0.045), color=color, linewidth=2.4)
    sheet.text(x + 0.32, y, curve.name, fontsize=TEXT + 1, weight="bold", color=color)
    sheet.text(x + 0.32, y + 0.18, f"{_smoothness(curve.jumps)}; {_overshoot(curve)}", fontsize=SMALL, color=SOFT)


def _lens(sheet: Figure, curves: Sequence[_Curve], widest: _Curve, x: float, y: float) -> None:
    """Draw the largest overshoot magnified."""
    off = np.nan_to_num(widest.points[:, 0] - widest.bounds) * np.sign(widest.worst)
    at = int(off.argmax())
    inside = np.flatnonzero(off > 0)
    near = inside[np.abs(inside - at) < SEGMENT_POINTS]
    start, end = float(widest.times[near].min()), float(widest.times[near].max())
    level, size = float(widest.bounds[at]), abs(widest.worst)
    height = min(1.3, sheet.height - y - FOOT)
    axes = sheet.panel(x, y, WORDS - 0.75, height)
    for i, curve in enumerate(curves):
        value = curve.points[:, 0]
        axes.fill_between(curve.times, value, curve.bounds, color=COLORS[i], alpha=0.22, linewidth=0)
        axes.plot(curve.times, value, color=COLORS[i], linewidth=1.4)
    axes.set_xlim(start - 0.7 * (end - start), end + 0.7 * (end - start))
    low, high = (level - 1.5 * size, level + 1.5 * size)
    axes.set_ylim(low, high)
    axes.set_yticks([level, level + widest.worst], [format_number(level), f"{level + widest.worst:.4g}"])
    axes.set_xticks([float(widest.times[at])], [f"{format_number(float(widest.times[at]))} s"])
    axes.tick_params(axis="x", length=3, width=0.6, color=SOFT)
    sheet.text(x, y - 0.08, "overshoot, magnified", fontsize=SMALL, color=SOFT)


def _smoothness(jumps: KeyJumps) -> str:
    """Continuity at the interior keys: "C1 at every key", "C0 at 1 key, C1 at 3 keys"."""
    counts = Counter(jumps.grades)
    if not counts:
        return "one segment"
    if len(counts) == 1:
        grade = jumps.grades[0]
        return "jumps at every key" if grade is ContinuityClass.JUMP else f"{grade} at every key"
    return ", ".join(
        f"{grade} at {counts[grade]} key{'s' * (counts[grade] > 1)}" for grade in ContinuityClass if counts[grade]
    )


def _overshoot(curve: _Curve) -> str:
    if curve.departure > 0:
        return f"up to {format_number(curve.departure)} off the keys"
    if curve.worst == 0:
        return "no overshoot"
    return f"overshoots by {format_number(abs(curve.worst))}"
