"""Equations by which the stability of a step is judged: an oscillator, and drag."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from anim.arrays import Floats
from anim.simulation.integrators import Integrator


@dataclass(frozen=True, slots=True)
class TestEquation:
    """Equation by which stability is judged. symbol: of the rate times the step, about: of the axis.

    max_value: end of the axis. gain, limit: of an integrator.
    """

    symbol: str
    about: str
    gain_of: str
    max_value: float
    gain: Callable[[Integrator, Floats], Floats]
    limit: Callable[[Integrator], float]


TEST_EQUATIONS = {
    "oscillator": TestEquation(
        "ω·h",
        "ω·h: angular frequency of the stiffest part × step",
        "Amplitude",
        3.4,
        lambda method, w: method.gain(w),
        lambda method: method.limit,
    ),
    "drag": TestEquation(
        "drag·h",
        "drag·h: drag of the fastest particle × step",
        "Velocity",
        4.6,
        lambda method, z: method.drag_gain(z),
        lambda method: method.drag_limit,
    ),
}
