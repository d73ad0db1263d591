"""Closed loops of a cloth: rounds of the clip until the motion repeats, or a blend of two rounds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints

MAX_ROUNDS = 8
SETTLED_M = 1e-4  # largest distance of a point between two rounds that count as equal
BLEND_S = 0.5  # over which one round leads to another, if the motion never repeats


@dataclass(frozen=True, slots=True)
class LoopSeam:
    """Closing of a loop: rounds that were run, whether the last two were equal, and the seam in m.

    distance: the seam, the largest distance of a point between both ends before they were made equal. first: index of
    the frame of the run at which the loop begins.
    """

    rounds: int
    settled: bool
    distance: float
    first: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class _Candidate:
    """Frames of a run from which a loop can be made.

    positions: of one round, F in number with both ends. before: the frames that lead to its first one.
    """

    positions: Floats
    energies: Floats
    before: Floats
    first: int
    cost: float


def close_loop(frames: Iterator[tuple[Floats, float]], num_frames: int, fps: float) -> tuple[Floats, Floats, LoopSeam]:
    """Return positions (F, P, 3) whose last frame is the first, energies (F,), and the seam.

    frames: positions (P, 3) and energies of (MAX_ROUNDS · (F − 1) + 1) frames at most. Rounds are taken until no point
    is over 0.1 mm from its position a round earlier. If that never happens, as with cloth that flutters, the seam is
    where two rounds are nearest, at any time of the clip. There the last 0.5 s, or half of a shorter loop, lead over to
    the round before: both are real motions. Frames begin at the clip's start, wherever the seam is.
    """
    count = num_frames - 1
    num_blended = max(int(min(BLEND_S * fps, count / 2)), 1)
    first, energy = next(frames)
    kept, energies = first[None], np.array([energy])  # the last three rounds at most
    begin, best = 0, None  # index of the first of them
    for rounds in range(1, MAX_ROUNDS + 1):
        taken = [next(frames) for _ in range(count)]
        kept = np.concatenate([kept, [x for x, _ in taken]])[-3 * count - 1 :]
        energies = np.append(energies, [e for _, e in taken])[-3 * count - 1 :]
        begin = rounds * count + 1 - len(kept)
        if rounds == 1:
            continue
        distances = np.sqrt(((kept[count:] - kept[:-count]) ** 2).sum(axis=-1)).max(axis=-1)
        if distances[-count - 1 :].max() < SETTLED_M:
            best = _candidate(kept, energies, begin, len(kept) - 1, count, num_blended, 0.0)
            return *_blend(best, count), LoopSeam(rounds, True, float(distances[-1]), best.first)
        costs = _window_maxima(distances, max(num_blended // 2, 1))  # in the first half the other round counts little
        ends = np.arange(len(costs)) + count + max(num_blended // 2, 1) - 1
        allowed = (ends >= count + num_blended) & (ends >= len(kept) - count)
        k = int(np.where(allowed, costs, np.inf).argmin())
        if best is None or costs[k] < best.cost:
            best = _candidate(kept, energies, begin, int(ends[k]), count, num_blended, float(costs[k]))
    assert best is not None
    seam = float(np.sqrt(((best.positions[-1] - best.positions[0]) ** 2).sum(axis=-1)).max())
    return *_blend(best, count), LoopSeam(MAX_ROUNDS, False, seam, best.first)


def loop_rows(first: int, count: int) -> Ints:
    """Return the frames (count + 1,) of a run of which a loop consists, from the clip's start on."""
    return first + (np.arange(count + 1) - first) % count


def _candidate(
    kept: Floats, energies: Floats, begin: int, end: int, count: int, num_blended: int, cost: float
) -> _Candidate:
    """The loop that ends at row `end` of the kept frames. begin: index of the first of them in the run."""
    start = end - count
    before = kept[start - num_blended + 1 : start + 1].copy()
    return _Candidate(kept[start : end + 1].copy(), energies[start : end + 1].copy(), before, begin + start, cost)


def _blend(loop: _Candidate, count: int) -> tuple[Floats, Floats]:
    """Positions and energies from the clip's start on, the last frames led over to those before the first."""
    closed, size = loop.positions.copy(), len(loop.before)
    u = np.arange(1, size + 1) / size
    weight = (u * u * (3 - 2 * u))[:, None, None]
    closed[-size:] += weight * (loop.before - loop.positions[-size:])
    rows = loop_rows(loop.first, count) - loop.first
    return closed[rows], loop.energies[rows]


def _window_maxima(values: Floats, size: int) -> Floats:
    """The largest of each `size` values in a row."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(values, size).max(axis=1))
