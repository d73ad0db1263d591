"""Table of easings, their parser, and sparklines."""

from __future__ import annotations

import numpy as np

from anim.curves.easing.css import JUMPS, cubic_bezier, steps
from anim.curves.easing.expression import Factory, number, numbers, parse_call
from anim.curves.easing.function import Easing
from anim.curves.easing.penner import back_in, back_in_out, back_out, penner
from anim.curves.easing.polynomial import hermite, linear, smootherstep, smoothstep
from anim.curves.easing.spring import spring
from anim.errors import RangeError

BARS = "▁▂▃▄▅▆▇█"


def _easings() -> dict[str, Easing]:
    css = [
        cubic_bezier(0.25, 0.1, 0.25, 1, name="ease"),
        cubic_bezier(0.42, 0, 1, 1, name="ease-in"),
        cubic_bezier(0, 0, 0.58, 1, name="ease-out"),
        cubic_bezier(0.42, 0, 0.58, 1, name="ease-in-out"),
    ]
    return {ease.name: ease for ease in (linear(), smoothstep(), smootherstep(), *css, *penner())}


def _steps(arguments: tuple[str, ...]) -> Easing:
    """Return steps(n) or steps(n, jump); the prefix "jump-" is optional."""
    if not 1 <= len(arguments) <= 2:
        raise RangeError(f"number of arguments is {len(arguments)} (expected 1 or 2)")
    count = number(arguments[0])
    if not count.is_integer():
        raise RangeError(f"number of steps is {count:g} (expected a whole number)")
    jump = arguments[1].lower() if len(arguments) == 2 else "jump-end"
    return steps(int(count), f"jump-{jump}" if f"jump-{jump}" in JUMPS else jump)


EASINGS: dict[str, Easing] = _easings()

EASING_FACTORIES: dict[str, Factory[Easing]] = {
    "cubic-bezier": Factory(
        "cubic-bezier(x1, y1, x2, y2)",
        lambda args: cubic_bezier(*numbers(args, 4)),
        (
            "cubic-bezier(0.2, 0, 0, 1)",
            "cubic-bezier(1/3, -0.4, 2/3, 1.7)",
            "cubic-bezier(0, 1.5, 1, -0.5)",
            "cubic-bezier(0.5, 0.5, 0.5, 0.5)",
            "cubic-bezier(1, 0, 0, 1)",
        ),
    ),
    "steps": Factory(
        "steps(n, jump-start|jump-end|jump-both|jump-none)",
        _steps,
        ("steps(1)", "steps(5)", "steps(4, jump-start)", "steps(3, both)", "steps(3, none)"),
    ),
    "spring": Factory(
        "spring(stiffness, damping)",
        lambda args: spring(*numbers(args, 2)),
        ("spring(100, 10)", "spring(100, 2)", "spring(100, 20)", "spring(100, 300)"),
    ),
    "hermite": Factory("hermite(slope0, slope1)", lambda args: hermite(*numbers(args, 2)), ("hermite(-1, 4)",)),
    "back": Factory(
        "back(overshoot), which is back-out(overshoot)", lambda args: back_out(*numbers(args, 1)), ("back(3)",)
    ),
    "back-in": Factory("back-in(overshoot)", lambda args: back_in(*numbers(args, 1)), ("back-in(0.5)",)),
    "back-out": Factory("back-out(overshoot)", lambda args: back_out(*numbers(args, 1)), ("back-out(1.2)",)),
    "back-in-out": Factory("back-in-out(overshoot)", lambda args: back_in_out(*numbers(args, 1)), ("back-in-out(2)",)),
}


def parse(text: str) -> Easing:
    """Return the easing named by a text: one of EASINGS, or one of EASING_FACTORIES with its arguments.

    Raises RangeError for an unknown name, with the nearest ones in its help, and for invalid arguments.
    parse("cubic-bezier(.2, 0, 0, 1)").value(0.5) → 0.87
    """
    return parse_call(text, EASINGS, EASING_FACTORIES, kind="easing", listing="EASINGS")


def sparkline(easing: Easing, width: int = 24) -> str:
    """Return the curve as one line of `width` bars, scaled to its lowest and highest value.

    Raises RangeError for a width below 2.
    sparkline(EASINGS["linear"], 8) → ▁▂▃▄▅▆▇█
    """
    if width < 2:
        raise RangeError(f"width is {width} (expected 2 or more)")
    low, high = easing.extent
    heights = (easing.value(np.linspace(0, 1, width)) - low) / (high - low)
    levels = np.clip(np.rint(heights * (len(BARS) - 1)), 0, len(BARS) - 1).astype(int)
    return "".join(BARS[level] for level in levels.tolist())
