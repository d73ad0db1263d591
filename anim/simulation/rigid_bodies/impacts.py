"""Impacts inside steps: times and positions at which the paths before and after a jump of velocity meet."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats

MIN_IMPACT_SPEED_M_S = 0.3  # change of velocity that is an impact; bodies at rest in contact jitter less
MIN_DISTANCE_STEPS = 0.02  # from a step: nearer impacts are at the step


def find_impacts(times: Floats, positions: Floats, gravity: Floats) -> tuple[Floats, Floats]:
    """Return times (I,) and positions (I, 3) of a body's impacts.

    times: (S,) s, of equal steps. positions: (S, 3). gravity: (3,) m/s², the acceleration without contact. The velocity
    before a step and after it are those of the neighboring steps; an impact is a step that changes it most.
    """
    if len(times) < 4:
        return np.empty(0), np.empty((0, 3))
    h = times[1]
    velocities = np.diff(positions, axis=0) / h
    jumps = velocities[2:] - velocities[:-2] - 2 * h * gravity
    speeds = np.linalg.norm(jumps, axis=1)
    padded = np.concatenate(([0.0], speeds, [0.0]))
    is_peak = (speeds >= padded[:-2]) & (speeds > padded[2:]) & (speeds > MIN_IMPACT_SPEED_M_S)
    steps = np.flatnonzero(is_peak)
    before, after = velocities[steps] + h / 2 * gravity, velocities[steps + 2] - h / 2 * gravity
    direction = jumps[steps] / speeds[steps, None]
    start, end = positions[steps + 1], positions[steps + 2]
    closing = _dot(before - after, direction)
    rest = _dot(end - start - h * after, direction) / np.where(closing == 0, 1.0, closing)
    inside = (rest > MIN_DISTANCE_STEPS * h) & (rest < (1 - MIN_DISTANCE_STEPS) * h)
    moments = times[steps + 1] + rest
    return moments[inside], (start + rest[:, None] * before)[inside]


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray((a * b).sum(axis=1))
