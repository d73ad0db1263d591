"""Required keys of a sampled motion: steps remain STEP, constant intervals need no inner keys."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.model import Interpolation, Track
from anim.sampling.times import just_before

ROUNDING_TOLERANCE = 1e-11  # relative; rounding of constant float64 values


def inside_interval(knots: Floats) -> Floats:
    """Return times (3 (T - 1),) at the start, middle and before the end of each interval of knots (T,)."""
    starts, ends = knots[:-1], just_before(knots[1:])
    return np.concatenate((starts, (starts + ends) / 2, ends))


def is_step(values: Floats, *, tolerance: float) -> bool:
    """True if values at `inside_interval` (3 (T - 1), C) are constant per interval; rotations up to sign."""
    start, middle, end = values.reshape(3, -1, values.shape[1])
    return all(_distance(start, other).max(initial=0.0) <= tolerance for other in (middle, end))


def as_step(node: int, path: str, times: Floats, values: Floats) -> Track:
    """Return a STEP track of values (K, C) at times (K,) without unchanged inner keys."""
    kept = np.concatenate(([True], _distance(values[1:], values[:-1]) > ROUNDING_TOLERANCE))
    kept[-1] = True
    return Track(node, path, Interpolation.STEP, times[kept], values[kept])


def as_linear(node: int, path: str, times: Floats, values: Floats, *, before: Floats, thin: bool) -> Track:
    """Return a LINEAR track of values (K, C) at times (K,).

    before: times of keys just before the next one, for a jump; omitted if this track has none. thin: omit keys inside
    constant intervals, too.
    """
    kept = ~np.isin(times, before) | _jumps(times, values)
    kept[[0, -1]] = True
    times, values = times[kept], values[kept]
    if thin and len(times) > 2:
        changes = _distance(values[1:], values[:-1]) > ROUNDING_TOLERANCE
        kept = np.concatenate(([True], changes[1:] | changes[:-1], [True]))
        times, values = times[kept], values[kept]
    return Track(node, path, Interpolation.LINEAR, times, values)


def _jumps(times: Floats, values: Floats) -> Bools:
    """True (K,) for keys with more than twice the speed after them as before."""
    seconds, far = np.diff(times), _distance(values[1:], values[:-1])
    jumps = np.ones(len(times), np.bool_)
    jumps[1:-1] = far[1:] > ROUNDING_TOLERANCE + 2 * far[:-1] * seconds[1:] / seconds[:-1]
    return jumps


def _distance(a: Floats, b: Floats) -> Floats:
    """Distances (K,) of values (K, C), of quaternions up to sign."""
    if a.shape[-1] == 4:
        b = np.where((quaternion.dot(a, b) < 0)[..., None], -b, b)
    return np.asarray(np.abs(a - b).max(axis=-1))
