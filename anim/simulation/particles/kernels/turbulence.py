"""Turbulence of the air: random Fourier modes at right angles to their waves, compiled."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.simulation.particles.kernels.vectors import Vector
from anim.skinning.kernels.jit import inline, jit

PER_PI = 1 / np.pi


@jit
def cosine(x: float) -> float:
    """Return cos x within 1e-10, for |x| below 1e5: products and sums alone, which are alike on every machine.

    Taylor's polynomial on −π/2 … π/2, with the sign of the half wave.
    """
    half_waves = np.floor(x * PER_PI + 0.5)
    y = x - half_waves * np.pi
    s = y * y
    sign = 1.0 - 2.0 * (half_waves - 2.0 * np.floor(0.5 * half_waves))
    value = 1 / 479001600 + s * (-1 / 87178291200)
    value = -1 / 3628800 + s * value
    value = 1 / 40320 + s * value
    value = -1 / 720 + s * value
    value = 1 / 24 + s * value
    value = -1 / 2 + s * value
    return float(sign * (1.0 + s * value))


@inline
def turbulent_velocity(modes: Floats, scratch: Floats, t: float, x: Vector, wind: Vector) -> Vector:
    """Return the velocity of the air in m/s at t s: the wind and all modes (8, M), which have no divergence.

    scratch: (M,), for the cosines: without a sum in their loop four are computed at once.
    """
    for m in range(len(scratch)):
        wave = modes[0, m] * x[0] + modes[1, m] * x[1] + modes[2, m] * x[2]
        scratch[m] = cosine(wave + modes[6, m] * t + modes[7, m])
    ux, uy, uz = wind
    for m in range(len(scratch)):
        ux += scratch[m] * modes[3, m]
        uy += scratch[m] * modes[4, m]
        uz += scratch[m] * modes[5, m]
    return (ux, uy, uz)
