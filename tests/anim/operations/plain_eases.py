"""Every named ease once more, one number at a time, from its published formula: the second route for written files.

Sources: easings.net for Penner's set, CSS Easing Functions Level 1 for cubic-bezier, minimum jerk (Flash & Hogan).
expo is scaled to hit 0 and 1 exactly, which the published one misses by 2⁻¹⁰.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from scipy.optimize import brentq

Ease = Callable[[float], float]
BACK = 1.70158
TINY = 2.0**-10


def bezier(x1: float, y1: float, x2: float, y2: float) -> Ease:
    """The CSS curve: y where x is u, found by bracketing."""

    def curve(a: float, b: float, s: float) -> float:
        return 3 * a * s * (1 - s) ** 2 + 3 * b * s * s * (1 - s) + s**3

    return lambda u: curve(y1, y2, brentq(lambda s: curve(x1, x2, s) - u, 0, 1, xtol=1e-14)) if 0 < u < 1 else u


def bounce_out(x: float) -> float:
    """Four parabolas."""
    n, d = 7.5625, 2.75
    for start, shift, lift in ((1 / d, 0.0, 0.0), (2 / d, 1.5 / d, 0.75), (2.5 / d, 2.25 / d, 0.9375)):
        if x < start:
            return n * (x - shift) ** 2 + lift
    return n * (x - 2.625 / d) ** 2 + 0.984375


def elastic_out(x: float) -> float:
    """A dying swing; the published one misses 0 and 1 by 2⁻¹⁰."""
    return 2 ** (-10 * x) * math.sin((x - 0.075) * 2 * math.pi / 0.3) + 1


def mirrored(ease: Ease) -> Ease:
    """Out from in."""
    return lambda x: 1 - ease(1 - x)


def halves(ease: Ease) -> Ease:
    """In-out from in."""
    return lambda x: ease(2 * x) / 2 if x < 0.5 else 1 - ease(2 - 2 * x) / 2


def _power(n: int) -> Ease:
    return lambda x: x**n


INS: dict[str, Ease] = {
    "quad": _power(2),
    "cubic": _power(3),
    "quart": _power(4),
    "quint": _power(5),
    "sine": lambda x: 1 - math.cos(x * math.pi / 2),
    "expo": lambda x: (2 ** (10 * x - 10) - TINY) / (1 - TINY),
    "circ": lambda x: 1 - math.sqrt(1 - x * x),
    "back": lambda x: (BACK + 1) * x**3 - BACK * x * x,
    "bounce": mirrored(bounce_out),
}

EASES: dict[str, Ease] = {
    "smoothstep": lambda x: x * x * (3 - 2 * x),
    "smootherstep": lambda x: x**3 * (10 + x * (6 * x - 15)),
    "ease": bezier(0.25, 0.1, 0.25, 1),
    "ease-in": bezier(0.42, 0, 1, 1),
    "ease-out": bezier(0, 0, 0.58, 1),
    "ease-in-out": bezier(0.42, 0, 0.58, 1),
    "cubic-bezier(.2, 0, 0, 1)": bezier(0.2, 0, 0, 1),
    **{f"{name}-in": ease for name, ease in INS.items()},
    **{f"{name}-out": mirrored(ease) for name, ease in INS.items()},
    **{f"{name}-in-out": halves(ease) for name, ease in INS.items() if name not in ("back", "sine")},
    "sine-in-out": lambda x: (1 - math.cos(math.pi * x)) / 2,
    "back-in-out": halves(lambda x: (BACK * 1.525 + 1) * x**3 - BACK * 1.525 * x * x),
    "hermite(2, 0)": lambda x: 2 * x - x * x,
}
