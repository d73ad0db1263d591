"""Penner's easings: eleven curves, each as in (slow start), out (slow end) and in-out.

Source: Penner, "Programming Macromedia Flash MX" 2002, ch. 7; constants as on easings.net. One difference: expo and
elastic are scaled to begin at 0 and end at 1, as in d3-ease. The published forms jump there; they differ by up to 2⁻¹⁰,
in-out forms by half of that.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.curves.easing.function import (
    MAX_PARAMETER,
    CubicSegment,
    Easing,
    ease_in_out_from,
    ease_out_from,
    format_call,
)
from anim.errors import RangeError

OVERSHOOT = 1.70158  # back: overshoots the range by 10 %
IN_OUT_OVERSHOOT = 1.525  # × OVERSHOOT: 10 % of the range again, though each half has half the height
PERIOD = 0.3  # elastic: one oscillation, in u
IN_OUT_PERIOD = 0.45  # elastic in-out: in u of each half
EXPO_RISE = 1023.0  # 2¹⁰ − 1


def penner() -> list[Easing]:
    """Return all easings of the family: quad-in, quad-out, quad-in-out, cubic-in and so on."""
    table = [form for name, n in _POWERS for form in _forms(_power(name, n))]
    table += [_sine(), ease_out_from(_sine(), "sine-out"), _sine_in_out()]
    table += [*_forms(_expo()), *_forms(_circ())]
    table += [back_in(OVERSHOOT, name="back-in"), back_out(OVERSHOOT, name="back-out")]
    table += [back_in_out(OVERSHOOT, name="back-in-out")]
    table += [_elastic(PERIOD), ease_out_from(_elastic(PERIOD), "elastic-out")]
    table += [ease_in_out_from(_elastic(IN_OUT_PERIOD), "elastic-in-out")]
    bounce = ease_out_from(_bounce_out(), "bounce-in")
    return [*table, bounce, _bounce_out(), ease_in_out_from(bounce, "bounce-in-out")]


def back_in(overshoot: float, *, name: str = "") -> Easing:
    """Return the easing with an undershoot: (s+1)u³ − su² for s = `overshoot` ≥ 0; 10 % for 1.70158.

    Raises RangeError for an overshoot that is negative or over MAX_PARAMETER.
    """
    s = float(overshoot)
    if not 0 <= s <= MAX_PARAMETER:
        raise RangeError(f"overshoot is {s:g} (expected 0 … {MAX_PARAMETER}; 1.70158 is 10 % of the way)")
    return Easing(
        name or format_call("back-in", s),
        lambda u: u * u * (1 + (s + 1) * (u - 1)),
        lambda u: u * (3 * (s + 1) * u - 2 * s),
        exact=(CubicSegment(0, 1, 0, 1, 0, s + 3),),
    )


def back_out(overshoot: float, *, name: str = "") -> Easing:
    """Return the easing with a final overshoot: back_in time-reversed."""
    return ease_out_from(back_in(overshoot), name or format_call("back-out", overshoot))


def back_in_out(overshoot: float, *, name: str = "") -> Easing:
    """Return the easing with undershoot and overshoot: halves of back_in with 1.525 · `overshoot`."""
    return ease_in_out_from(back_in(overshoot * IN_OUT_OVERSHOOT), name or format_call("back-in-out", overshoot))


_POWERS = (("quad", 2), ("cubic", 3), ("quart", 4), ("quint", 5))


def _forms(ease: Easing) -> tuple[Easing, Easing, Easing]:
    """Return an in form with its out and in-out forms."""
    family = ease.name.removesuffix("-in")
    return ease, ease_out_from(ease, f"{family}-out"), ease_in_out_from(ease, f"{family}-in-out")


def _power(name: str, n: int) -> Easing:
    exact = (CubicSegment(0, 1, 0, 1, 0, n),) if n <= 3 else None
    return Easing(f"{name}-in", lambda u: u**n, lambda u: n * u ** (n - 1), exact=exact)


def _sine() -> Easing:
    """Return 1 − cos(πu/2), written with the sine since cos(π/2) is not 0 in floats."""
    return Easing("sine-in", lambda u: 1 - np.sin((1 - u) * np.pi / 2), lambda u: np.sin(u * np.pi / 2) * np.pi / 2)


def _sine_in_out() -> Easing:
    """Return ½ − ½ cos πu: smooth, without the breakpoint of two halves."""

    def slope(u: Floats) -> Floats:
        return np.asarray(np.sin(np.pi * np.minimum(u, 1 - u)) * np.pi / 2)

    return Easing("sine-in-out", lambda u: (1 - np.cos(np.pi * u)) / 2, slope)


def _expo() -> Easing:
    return Easing("expo-in", _rise, _rise_slope)


def _circ() -> Easing:
    def slope(u: Floats) -> Floats:
        root = np.sqrt((1 - u) * (1 + u))
        return np.where(root > 0, u / np.where(root > 0, root, 1.0), np.inf)

    return Easing("circ-in", lambda u: 1 - np.sqrt((1 - u) * (1 + u)), slope)


def _elastic(period: float) -> Easing:
    """Return the oscillation of `period` (in u) with the envelope expo-in, which ends at its peak."""
    rate = 2 * np.pi / period

    def phase(u: Floats) -> Floats:
        return np.asarray((u - 1 - period / 4) * rate)

    return Easing(
        "elastic-in",
        lambda u: -_rise(u) * np.sin(phase(u)),
        lambda u: -_rise_slope(u) * np.sin(phase(u)) - rate * _rise(u) * np.cos(phase(u)),
    )


def _bounce_out() -> Easing:
    """Return a fall and three rebounds: parabolas (11/4)² (u − c)² + floor, 1 at 4/11, 8/11, 10/11 and 1."""
    breaks = np.array([4, 8, 10]) / 11
    centers = np.array([0, 6, 9, 10.5]) / 11
    floors = np.array([0, 0.75, 0.9375, 0.984375])

    def value(u: Floats) -> Floats:
        at = np.searchsorted(breaks, u, side="right")
        return np.asarray(7.5625 * (u - centers[at]) ** 2 + floors[at])

    def derivative(u: Floats) -> Floats:
        return np.asarray(15.125 * (u - centers[np.searchsorted(breaks, u, side="right")]))

    edges = (0.0, *breaks.tolist(), 1.0)
    exact = tuple(
        CubicSegment(a, b, 0.0 if a == 0 else 1.0, 1.0, 15.125 * (a - c), 15.125 * (b - c))
        for a, b, c in zip(edges, edges[1:], centers.tolist(), strict=False)
    )
    return Easing("bounce-out", value, derivative, edges[1:-1], exact)


def _rise(u: Floats) -> Floats:
    """Return (2^(10u) − 1) / (2^10 − 1): exactly 0 at 0 and 1 at 1."""
    return np.asarray((np.exp2(10 * u) - 1) / EXPO_RISE)


def _rise_slope(u: Floats) -> Floats:
    return np.asarray(10 * np.log(2) * np.exp2(10 * u) / EXPO_RISE)
