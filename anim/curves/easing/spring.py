"""Easing of a damped spring, released at 0 with equilibrium at 1."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.curves.easing.function import Easing, format_call
from anim.errors import RangeError

SETTLING_TOLERANCE = 1e-3  # distance from 1 below which the spring has settled
MIN_DAMPING_RATIO = 0.005  # 200 oscillations until it settles, the limit for keys
CRITICAL_SETTLING = 9.233413476451586  # the root of (1 + x) e^−x = SETTLING_TOLERANCE


def spring(stiffness: float, damping: float, *, name: str = "") -> Easing:
    """Return the motion of a mass of 1 kg on a spring, from rest until it has settled at 1, as an easing.

    stiffness: k in N/m, > 0. damping: c in N·s/m, > 0. Only the ratio ζ = c / (2 √k) determines the shape, since u = 1
    is the settling time: ζ < 1 oscillates, ζ ≥ 1 does not. A factor within 0.1 % of 1 makes the end exactly 1.
    Raises RangeError if one of them is not positive, or if ζ < 0.005 (more than 200 oscillations).
    spring(100, 10) → one overshoot by 16 %, u = 1 at settle_time(100, 10) = 1.41 s
    """
    end = settle_time(stiffness, damping)
    last = float(_position(np.array(end), stiffness, damping))
    return Easing(
        name or format_call("spring", stiffness, damping),
        lambda u: _position(u * end, stiffness, damping) / last,
        lambda u: _speed(u * end, stiffness, damping) * end / last,
    )


def settle_time(stiffness: float, damping: float) -> float:
    """Return the time in seconds until the error stays below 0.1 %. Raises RangeError as `spring`.

    It is defined on the envelope of the oscillation, so that it is a continuous function of the damping.
    """
    if not (stiffness > 0 and damping > 0 and np.isfinite((stiffness, damping)).all()):
        raise RangeError(f"stiffness and damping are {stiffness:g} and {damping:g} (expected finite and above 0)")
    omega, decay = np.sqrt(stiffness), damping / 2
    ratio = decay / omega
    if ratio < MIN_DAMPING_RATIO:
        raise RangeError(
            f"the spring hardly settles: damping ratio {ratio:.2g} (expected {MIN_DAMPING_RATIO} or more)",
            help=f"a damping of {2 * omega * MIN_DAMPING_RATIO:.3g} or more",
        )
    if ratio > 1:
        return _settle_overdamped(stiffness, damping)
    swinging = -np.log(SETTLING_TOLERANCE * np.sqrt(1 - ratio * ratio)) if ratio < 1 else np.inf
    return float(min(swinging, CRITICAL_SETTLING) / decay)


def _settle_overdamped(stiffness: float, damping: float) -> float:
    """Return the settling time of an over-damped spring by bisection: its distance only decreases."""
    low, high = 0.0, 2 * CRITICAL_SETTLING * damping / stiffness
    for _ in range(60):
        middle = (low + high) / 2
        if 1 - float(_position(np.array(middle), stiffness, damping)) > SETTLING_TOLERANCE:
            low = middle
        else:
            high = middle
    return high


def _position(t: Floats, stiffness: float, damping: float) -> Floats:
    """Return x(t), from 0 at rest to 1: x″ + c x′ + k x = k."""
    decay, gap = damping / 2, damping * damping / 4 - stiffness
    if gap <= 0:
        return np.asarray(
            1 - np.exp(-decay * t) * np.cos(np.sqrt(-gap) * t) - decay * _oscillation(t, stiffness, damping)
        )
    beta = np.sqrt(gap)
    slow = stiffness / (decay + beta)
    even = (np.exp(-slow * t) + np.exp(-(decay + beta) * t)) / 2
    return np.asarray(1 - even - decay * _oscillation(t, stiffness, damping))


def _speed(t: Floats, stiffness: float, damping: float) -> Floats:
    return stiffness * _oscillation(t, stiffness, damping)


def _oscillation(t: Floats, stiffness: float, damping: float) -> Floats:
    """Return e^(−ct/2) sin(ωt) / ω, ω² = k − c²/4, and its limits for ω = 0 or imaginary ω (sinh)."""
    decay, gap = damping / 2, damping * damping / 4 - stiffness
    if gap <= 0:
        return np.asarray(np.exp(-decay * t) * t * np.sinc(np.sqrt(-gap) * t / np.pi))
    beta = np.sqrt(gap)
    slow = stiffness / (decay + beta)
    return np.asarray(np.exp(-slow * t) * -np.expm1(-2 * beta * t) / (2 * beta))
