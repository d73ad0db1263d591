"""Keys of a followed motion that say something: steps stay steps, and what stands still needs no keys in between."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.model import Interpolation, Track

ROUNDING = 1e-11  # of a value, that float64 leaves where nothing changes


def just_before(times: Floats) -> Floats:
    """Return the float32 times before times (T,) in seconds."""
    return np.nextafter(times.astype(np.float32), np.float32(0)).astype(np.float64)


def inside_interval(knots: Floats) -> Floats:
    """Return times (3 (T - 1),) at the start, in the middle and just before the end of each piece of knots (T,)."""
    starts, ends = knots[:-1], just_before(knots[1:])
    return np.concatenate((starts, (starts + ends) / 2, ends))


def is_step(values: Floats, *, tolerance: float) -> bool:
    """Whether values at the times of `within` (3 (T - 1), C) are the same in each piece; of rotations, either sign."""
    start, middle, end = values.reshape(3, -1, values.shape[1])
    return all(_distance(start, other).max(initial=0.0) <= tolerance for other in (middle, end))


def as_step(node: int, path: str, times: Floats, values: Floats) -> Track:
    """Return a STEP track of values (K, C) at times (K,), without keys that change nothing but the first and last."""
    kept = np.concatenate(([True], _distance(values[1:], values[:-1]) > ROUNDING))
    kept[-1] = True
    return Track(node, path, Interpolation.STEP, times[kept], values[kept])


def as_linear(node: int, path: str, times: Floats, values: Floats, *, before: Floats, thin: bool) -> Track:
    """Return a LINEAR track of values (K, C) at times (K,).

    before: times of keys that stand just before the next one in case of a jump; where this track has none, they are
    left out. thin: leave out keys inside stretches where nothing changes, too.
    """
    kept = ~np.isin(times, before) | _jumps(times, values)
    kept[[0, -1]] = True
    times, values = times[kept], values[kept]
    if thin and len(times) > 2:
        changes = _distance(values[1:], values[:-1]) > ROUNDING
        kept = np.concatenate(([True], changes[1:] | changes[:-1], [True]))
        times, values = times[kept], values[kept]
    return Track(node, path, Interpolation.LINEAR, times, values)


def _jumps(times: Floats, values: Floats) -> Bools:
    """Whether (K,) each key goes to the next faster than it came, by more than twice."""
    seconds, far = np.diff(times), _distance(values[1:], values[:-1])
    jumps = np.ones(len(times), np.bool_)
    jumps[1:-1] = far[1:] > ROUNDING + 2 * far[:-1] * seconds[1:] / seconds[:-1]
    return jumps


def _distance(a: Floats, b: Floats) -> Floats:
    """Distances (K,) of values (K, C), of quaternions by the nearer sign."""
    if a.shape[-1] == 4:
        b = np.where((quaternion.dot(a, b) < 0)[..., None], -b, b)
    return np.asarray(np.abs(a - b).max(axis=-1))
