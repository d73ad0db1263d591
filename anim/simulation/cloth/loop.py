"""Closed loops of a cloth: rounds of the clip until the motion repeats, or a blend of two rounds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats

MAX_ROUNDS = 8
SETTLED_M = 1e-4  # largest distance of a point between two rounds that count as equal
BLEND_S = 0.5  # of the end, if the motion never repeats


@dataclass(frozen=True, slots=True)
class LoopSeam:
    """Closing of a loop: rounds that were run, whether the last two were equal, and the seam in m.

    distance: the seam, the largest distance of a point between both ends before they were made equal.
    """

    rounds: int
    settled: bool
    distance: float


def close_loop(frames: Iterator[tuple[Floats, float]], num_frames: int, fps: float) -> tuple[Floats, Floats, LoopSeam]:
    """Return positions (F, P, 3) whose last frame is the first, energies (F,), and the seam.

    frames: positions (P, 3) and energies of (MAX_ROUNDS · (F − 1) + 1) frames at most. Rounds are taken until no point
    is over 0.1 mm from its position a round earlier, or the rounds stop to come nearer. Then the last 0.5 s, or half of
    a shorter loop, lead over to the end of the round before, from which the round begins: both are real motions.
    """
    count = num_frames - 1
    first, energy = next(frames)
    before, change, rounds = np.empty((0, *first.shape)), np.inf, 0
    while True:
        taken = [next(frames) for _ in range(count)]
        positions = np.array([first, *(x for x, _ in taken)])
        energies = np.array([energy, *(e for _, e in taken)])
        rounds += 1
        last, change = change, _largest_distance(positions, before) if rounds > 1 else np.inf
        if change < SETTLED_M or rounds == MAX_ROUNDS or (rounds > 2 and change >= last):
            break
        before, first, energy = positions, positions[-1], float(energies[-1])
    seam = LoopSeam(rounds, change < SETTLED_M, _largest_distance(positions[:1], positions[-1:]))
    num_blended = max(int(min(BLEND_S * fps, count / 2)), 1)
    u = np.arange(1, num_blended + 1) / num_blended
    weight = (u * u * (3 - 2 * u))[:, None, None]
    closed = positions.copy()
    closed[-num_blended:] += weight * (before[-num_blended:] - positions[-num_blended:])
    closed[-1] = closed[0]
    return closed, energies, seam


def _largest_distance(a: Floats, b: Floats) -> float:
    return float(np.sqrt(((a - b) ** 2).sum(axis=-1)).max(initial=0.0))
