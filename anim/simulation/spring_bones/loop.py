"""Closed loops: rounds of the driver until the motion repeats, or a blend of its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.simulation.spring_bones.solver import SpringMotion, SpringSolver
from anim.simulation.steps import Steps

MAX_ROUNDS = 20
SETTLED_M = 1e-4  # largest distance of a tail between two rounds that count as equal
BLEND_S = 0.2  # of the end, if the motion never repeats


@dataclass(frozen=True, slots=True)
class LoopedMotion:
    """One round of a loop, its first and last pose equal.

    motion: at every step, both ends included. rounds: that were run. settled: whether the last two were equal.
    seam: m, largest distance of a tail between both ends, before they were made equal.
    """

    motion: SpringMotion
    rounds: int
    settled: bool
    seam: float


def run_loop(solver: SpringSolver, steps: Steps) -> LoopedMotion:
    """Return the loop that the motion settles in, from a started solver.

    Rounds are run until no tail is over 0.1 mm from its position one round earlier, at most 20. Where that does not
    happen, the last 0.2 s (or half of a shorter loop) lead over to the first pose.
    """
    times = steps.times()[:-1]
    duration = steps.duration_s
    motion, change = solver.run(times), np.inf
    rounds = 1
    while rounds < MAX_ROUNDS and change >= SETTLED_M:
        solver.jump(duration, 0.0)
        before, motion = motion, solver.run(times)
        change = _largest_distance(motion.tails, before.tails)
        rounds += 1
    solver.jump(duration, 0.0)
    end = solver.run(times[:1])
    seam = _largest_distance(motion.tails[:1], end.tails)
    settled = change < SETTLED_M
    num_blended = 1 if settled else max(int(min(BLEND_S, duration / 2) / steps.step_s), 1)
    rotations = _close(np.concatenate((motion.rotations, end.rotations)), num_blended)
    tails = np.concatenate((motion.tails, end.tails))
    elongation = np.concatenate((motion.elongation, end.elongation))
    energies = np.concatenate((motion.energies, end.energies))
    return LoopedMotion(SpringMotion(rotations, tails, elongation, energies), rounds, settled, seam)


def _close(rotations: Floats, num_blended: int) -> Floats:
    """Rotations (S, J, 4) whose last `num_blended` steps lead over to the first."""
    difference = quaternion.rotation_vector(quaternion.multiply(quaternion.conjugate(rotations[-1]), rotations[0]))
    u = np.arange(1, num_blended + 1) / num_blended
    weight = u * u * (3 - 2 * u)
    closed = rotations.copy()
    correction = quaternion.from_rotation_vector(weight[:, None, None] * difference)
    closed[-num_blended:] = quaternion.multiply(rotations[-num_blended:], correction)
    return closed


def _largest_distance(a: Floats, b: Floats) -> float:
    return float(np.sqrt(((a - b) ** 2).sum(axis=-1)).max(initial=0.0))
