"""CSS easings: cubic Béziers in the time-value plane, and steps.

Source: W3C CSS Easing Functions Level 2, sections 2.2 and 2.3.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.curves.easing.function import MAX_PARAMETER, CubicSegment, Easing, format_call
from anim.errors import RangeError
from anim.maths import bezier

JUMPS = ("jump-start", "jump-end", "jump-both", "jump-none")
MAX_STEPS = 10_000  # above the frame count of one easing on any display
HANDLE_TOLERANCE = 1e-12  # distance of handles from 1/3 and 2/3 below which the Bézier is a cubic of time


def cubic_bezier(x1: float, y1: float, x2: float, y2: float, *, name: str = "") -> Easing:
    """Return the easing along the Bézier (0, 0), (x1, y1), (x2, y2), (1, 1): progress y over time x.

    x1 and x2 are in 0 … 1, y1 and y2 at most MAX_PARAMETER away from 0; RangeError otherwise. Handles at thirds of the
    time give an exact cubic, handles on the diagonal a line. The slope is ±inf at a vertical handle.
    cubic_bezier(0.25, 0.1, 0.25, 1) → CSS `ease`
    """
    if not (0 <= x1 <= 1 and 0 <= x2 <= 1):
        raise RangeError(f"x1 and x2 are {x1:g} and {x2:g} (expected 0 … 1, time can't run backwards)")
    if not np.abs((y1, y2)).max() <= MAX_PARAMETER:
        raise RangeError(f"y1 and y2 are {y1:g} and {y2:g} (expected -{MAX_PARAMETER} … {MAX_PARAMETER})")

    def value(u: Floats) -> Floats:
        return bezier.evaluate(bezier.parameter(u, x1, x2), y1, y2)

    def derivative(u: Floats) -> Floats:
        return _slope(bezier.parameter(u, x1, x2), (x1, y1), (x2, y2))

    exact = None
    if max(abs(x1 - 1 / 3), abs(x2 - 2 / 3)) < HANDLE_TOLERANCE:
        exact = (CubicSegment(0, 1, 0, 1, 3 * y1, 3 * (1 - y2)),)
    elif x1 == y1 and x2 == y2:
        exact = (CubicSegment(0, 1, 0, 1, 1, 1),)
    upright = (0.5,) if exact is None and x1 == 1 and x2 == 0 else ()
    return Easing(name or format_call("cubic-bezier", x1, y1, x2, y2), value, derivative, upright, exact)


def steps(count: int, jump: str = "jump-end", *, name: str = "") -> Easing:
    """Return the easing of `count` constant levels of equal duration; its exact form is STEP.

    jump: position of the first and last jump: "jump-start" jumps at u = 0, "jump-end" at u = 1, "jump-both" at both,
    "jump-none" at neither (count ≥ 2). At a jump the value is the one after it: value(0) > 0 for the first and third.
    Raises RangeError for a count outside 1 … 10 000 or another word.
    steps(2) → 0 on 0 … ½, ½ on ½ … 1, 1 at 1
    """
    if jump not in JUMPS:
        raise RangeError(f"jump is {jump!r} (expected {', '.join(JUMPS)})")
    least = 2 if jump == "jump-none" else 1
    if not (least <= count <= MAX_STEPS):
        raise RangeError(f"number of steps is {count} (expected {least} … {MAX_STEPS})")
    first = 1 if jump in ("jump-start", "jump-both") else 0
    whole = count + {"jump-both": 1, "jump-none": -1}.get(jump, 0)
    levels = np.append((np.arange(count) + first) / whole, 1.0)
    edges = np.arange(1, count + 1) / count

    def value(u: Floats) -> Floats:
        return np.asarray(levels[np.searchsorted(edges, u, side="right")])

    breaks = tuple(edges[:-1].tolist())
    exact = [
        CubicSegment(a, b, v, v, 0, 0)
        for a, b, v in zip((0.0, *breaks), (*breaks, 1.0), levels[:-1].tolist(), strict=True)
    ]
    return Easing(name or f"steps({count}, {jump})", value, np.zeros_like, breaks, tuple(exact))


def _slope(s: Floats, first: tuple[float, float], second: tuple[float, float]) -> Floats:
    """Return dy/dx at s; at the ends that of the first handle of non-zero length."""
    run = bezier.slope(s, first[0], second[0])
    rise = bezier.slope(s, first[1], second[1])
    upright = np.where(rise == 0, 0.0, np.copysign(np.inf, rise))
    with np.errstate(over="ignore"):  # a denormal x difference counts as vertical
        slope = np.where(run > 0, rise / np.where(run > 0, run, 1.0), upright)
    start = _handle_slope(first, second)
    end = _handle_slope((1 - second[0], 1 - second[1]), (1 - first[0], 1 - first[1]))
    return np.where(s <= 0, start, np.where(s >= 1, end, slope))


def _handle_slope(near: tuple[float, float], far: tuple[float, float]) -> float:
    """Return the slope towards the nearest control point distinct from the end point."""
    x, y = next(handle for handle in (near, far, (1.0, 1.0)) if handle != (0, 0))
    return y / x if x else float(np.copysign(np.inf, y))
