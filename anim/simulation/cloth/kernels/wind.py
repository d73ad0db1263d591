"""Pressure of the air on the faces of a cloth."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats, Ints
from anim.skinning.kernels.jit import jit


@jit
def add_wind(v: Floats, p: Floats, w: Floats, faces: Ints, wind: Floats, air: float, h: float) -> None:
    """Add the pressure of the air on both sides of each face: ½ ρ A |u·n| (u·n) n, u being the wind past the face."""
    for k in range(len(faces)):
        a, b, c = faces[k, 0], faces[k, 1], faces[k, 2]
        ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
        vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        double_area = np.sqrt(nx * nx + ny * ny + nz * nz)
        if double_area == 0.0:
            continue
        nx, ny, nz = nx / double_area, ny / double_area, nz / double_area
        past = (
            (wind[0] - (v[a, 0] + v[b, 0] + v[c, 0]) / 3.0) * nx
            + (wind[1] - (v[a, 1] + v[b, 1] + v[c, 1]) / 3.0) * ny
            + (wind[2] - (v[a, 2] + v[b, 2] + v[c, 2]) / 3.0) * nz
        )
        impulse = 0.5 * air * 0.5 * double_area * abs(past) * past * h / 3.0
        mass = 3.0 / max(w[a] + w[b] + w[c], 1e-300)  # harmonic mean: no more than stops the face in this step
        impulse = min(abs(impulse), mass * abs(past)) * (1.0 if past > 0 else -1.0)
        for i in (a, b, c):
            v[i, 0] += impulse * w[i] * nx
            v[i, 1] += impulse * w[i] * ny
            v[i, 2] += impulse * w[i] * nz
