"""Easing: progress of a motion as a function of the time fraction u, and its exact cubics if any."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.maths import hermite

Function: TypeAlias = Callable[[Floats], Floats]

MAX_PARAMETER = 100  # of handles, slopes and overshoots: a curve with more takes more keys than anybody stores
EXTENT_SAMPLES = 4097  # finds an extremum of curvature c with an error below c · 8e-9
OVERSHOOT_TOLERANCE = 1e-9  # smaller overshoots are rounding


@dataclass(frozen=True, slots=True)
class CubicSegment:
    """Cubic segment of an easing from u = `start` to `end`: end values, and slopes per u of the easing.

    On a segment of duration t_d from v0 to v1 the key values are v0 + value · (v1 − v0) and the CUBICSPLINE tangents
    slope · (v1 − v0) / t_d. If value1 of a segment is not value0 of the next one, the easing jumps.
    """

    start: float
    end: float
    value0: float
    value1: float
    slope0: float
    slope1: float


@dataclass(frozen=True, slots=True)
class Easing:
    """An easing: functions of u (any shape, each in 0 … 1) with value(0) = 0 and value(1) = 1.

    value: progress. Steps give the value after a jump; jump-start ones begin above 0.
    derivative: slope per u; ±inf at vertical tangents; of either side at a breakpoint.
    breakpoints: interior u, increasing, of non-smooth points and of keys of the exact form.
    exact: its cubic segments, covering 0 … 1 in order, or None if it is not piecewise cubic.
    """

    name: str
    value: Function
    derivative: Function
    breakpoints: tuple[float, ...] = ()
    exact: tuple[CubicSegment, ...] | None = None

    @property
    def extent(self) -> tuple[float, float]:
        """Least and greatest value, sampled: (0, 1) unless it overshoots."""
        values = self.value(np.linspace(0, 1, EXTENT_SAMPLES))
        low, high = float(values.min()), float(values.max())
        return (low if low < -OVERSHOOT_TOLERANCE else 0.0), (high if high > 1 + OVERSHOOT_TOLERANCE else 1.0)

    @property
    def overshoots(self) -> bool:
        """Return whether values leave 0 … 1."""
        return self.extent != (0.0, 1.0)

    @property
    def stepped(self) -> bool:
        """Return whether it is piecewise constant, so that a STEP sampler is its exact form."""
        return self.exact is not None and all(p.value0 == p.value1 and p.slope0 == p.slope1 == 0 for p in self.exact)


def format_call(name: str, *arguments: float) -> str:
    """Return the text form of a name with arguments: format_call("spring", 100, 10) → spring(100, 10)."""
    return f"{name}({', '.join(f'{argument:.15g}' for argument in arguments)})"


def evaluate(pieces: tuple[CubicSegment, ...], u: Floats) -> Floats:
    """Return the values at u (any shape, 0 … 1) of cubics that cover 0 … 1; at a jump the value after it.

    evaluate((CubicSegment(0, 1, 0, 1, 0, 0),), 0.5) → 0.5
    """
    columns = [(p.start, p.end - p.start, p.value0, p.value1, p.slope0, p.slope1) for p in pieces]
    start, length, value0, value1, slope0, slope1 = np.array(columns).T
    at = np.clip(np.searchsorted(start, u, side="right") - 1, 0, len(pieces) - 1)
    local = (u - start[at]) / length[at]
    return hermite.evaluate(local, value0[at], length[at] * slope0[at], value1[at], length[at] * slope1[at])


def ease_out_from(ease: Easing, name: str) -> Easing:
    """Return the time-reversed easing 1 − f(1 − u): the out form of an in form, and the reverse."""
    exact = None if ease.exact is None else tuple(_mirror(piece) for piece in reversed(ease.exact))
    return Easing(
        name,
        lambda u: 1 - ease.value(1 - u),
        lambda u: ease.derivative(1 - u),
        tuple(1 - b for b in reversed(ease.breakpoints)),
        exact,
    )


def ease_in_out_from(ease: Easing, name: str) -> Easing:
    """Return the in-out form of an in form: scaled by ½ up to the breakpoint u = ½, then point-mirrored."""

    def value(u: Floats) -> Floats:
        half = ease.value(np.where(u < 0.5, 2 * u, 2 - 2 * u)) / 2
        return np.where(u < 0.5, half, 1 - half)

    def derivative(u: Floats) -> Floats:
        return ease.derivative(np.where(u < 0.5, 2 * u, 2 - 2 * u))

    halves = tuple(b / 2 for b in ease.breakpoints)
    exact = None
    if ease.exact is not None:
        first = tuple(
            CubicSegment(p.start / 2, p.end / 2, p.value0 / 2, p.value1 / 2, p.slope0, p.slope1) for p in ease.exact
        )
        exact = first + tuple(_mirror(piece) for piece in reversed(first))
    return Easing(name, value, derivative, (*halves, 0.5, *(1 - b for b in reversed(halves))), exact)


def _mirror(p: CubicSegment) -> CubicSegment:
    return CubicSegment(1 - p.end, 1 - p.start, 1 - p.value1, 1 - p.value0, p.slope1, p.slope0)
