"""Limits of the quantities that describe a simulation: beyond, a number is a mistake, and results aren't finite."""

from __future__ import annotations

import math
from collections.abc import Sequence

from anim.errors import RangeError, check_number

MAX_SPEED_M_S, MAX_ACCELERATION_M_S2 = 1e4, 1e4  # of air and emitters; 1000 g
MAX_RATE_PER_S = 1e6  # of drag and damping
MAX_COEFFICIENT = 1e6  # of friction, and of other factors
MAX_LENGTH_M, MIN_RADIUS_M = 1e12, 1e-6  # of coordinates and sizes; of what forces are divided by
MAX_MASS_KG, MAX_DENSITY = 1e12, 1e12  # kg/m² or kg/m³
MAX_STIFFNESS_N_M, MAX_COMPLIANCE_M_N = 1e12, 1e12


def check_range(name: str, value: float, least: float, most: float, unit: str = "", *, is_above: bool = False) -> None:
    """Raise RangeError unless `value` is a finite number from `least` to `most`, or above `least` with is_above.

    Raises ShapeError for other types.

    check_range("mass", 1e308, 0, 1e12, "kg", is_above=True): `mass` is 1e+308 kg (expected above 0, at most 1e+12)
    """
    value = check_number(value, name)
    if not (value > least if is_above else value >= least) or not value <= most or not value < math.inf:
        end = f" {unit}" if unit else ""
        low = f"above {least:g}, at most" if is_above else f"{least:g} to"
        raise RangeError(f"`{name}` is {value:g}{end} (expected {low} {most:g})")


def check_largest(name: str, vector: Sequence[float], most: float, unit: str) -> None:
    """Raise RangeError unless all components of a vector are finite and at most `most` in magnitude."""
    largest = max(map(abs, vector)) if all(map(math.isfinite, vector)) else math.inf
    if largest > most:
        raise RangeError(f"`{name}` is {largest:g} {unit} (limit {most:g})")
