"""Fewer keys of particles, within a true bound of the distance."""

from __future__ import annotations

import numpy as np

from anim.arrays import Ints
from anim.errors import RangeError
from anim.simulation.particles.solver import ParticleKeys


def reduce_keys(keys: ParticleKeys, max_error: float) -> tuple[ParticleKeys, float]:
    """Return fewer of the keys, and a bound in m, at most `max_error`, of the distance between both paths at any time.

    Births, impacts and deaths stay; keys that stay are unchanged, and so is a parabola between two keys.
    Raises RangeError for a `max_error` that isn't above 0.
    """
    if not (np.isfinite(max_error) and max_error > 0):
        raise RangeError(f"`max_error` is {max_error:g} m (expected above 0)")
    from anim.simulation.particles.kernels.key_reduction import keep_keys, largest_error

    offsets: Ints = np.append(np.flatnonzero(np.diff(keys.particles, prepend=-1)), len(keys.times)).astype(np.int64)
    x, v_in, v_out = (np.ascontiguousarray(each) for each in (keys.positions, keys.in_velocities, keys.out_velocities))
    times = np.ascontiguousarray(keys.times)
    kept = keep_keys(offsets, times, x, v_in, v_out, max_error)
    return keys.at(np.flatnonzero(kept)), float(largest_error(times, x, v_in, v_out, offsets, kept))
