"""Keys and energies that a run of particles records; compiled."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.simulation.particles.kernels.force_field import ForceField, potential
from anim.simulation.particles.kernels.vectors import Vector, dot
from anim.skinning.kernels.jit import callee

MAX_IMPACTS_PER_STEP = 12  # then the particle stays where it is until the next step
MAX_KEYS_PER_STEP = 4 * MAX_IMPACTS_PER_STEP + 8
KEY_WIDTH = 10  # time, position, velocities before and after


@callee
def add_energy(energies: Floats, frame: int, field: ForceField, t: float, x: Vector, v: Vector) -> None:
    """Add the energies of a particle of 1 kg to those of a frame: number, kinetic, potential."""
    energies[frame, 0] += 1.0
    energies[frame, 1] += 0.5 * dot(v, v)
    energies[frame, 2] += potential(field, t, x)


@callee
def write_key(keys: Floats, count: Ints, t: float, x: Vector, before: Vector, after: Vector) -> None:
    """Append a key."""
    row = count[0]
    keys[row, 0] = t
    for c in range(3):
        keys[row, 1 + c], keys[row, 4 + c], keys[row, 7 + c] = x[c], before[c], after[c]
    count[0] += 1


@callee
def grow(keys: Floats, count: Ints) -> AnyArray:
    """Return the keys, with space for those of a step."""
    if count[0] + MAX_KEYS_PER_STEP <= len(keys):
        return keys
    larger = np.empty((2 * len(keys), KEY_WIDTH))
    for row in range(count[0]):  # a slice would compile the words of its error, a second
        for c in range(KEY_WIDTH):
            larger[row, c] = keys[row, c]
    return larger
