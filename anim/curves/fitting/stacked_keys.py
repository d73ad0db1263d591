"""Adaptive keys of many short motions at once: numpy's cost per call occurs once for all of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.curves.fitting import adaptive_keys
from anim.curves.fitting.adaptive_keys import (
    JUMP_TOLERANCE,
    MAX_ROUNDS,
    MAX_TRAVEL_RAD,
    NUM_LINEAR_SAMPLES,
    distance,
    number_parts,
    rotation_segment_count,
    round_to_float32,
    sample_times,
    vector_segment_count,
)
from anim.maths import quaternion
from anim.sampling.times import just_before

MAX_KEYS = adaptive_keys.MAX_KEYS // 2  # of one motion: one that needs too many is refused when it is fitted alone
MAX_STACK_KEYS = 1 << 20  # of all motions, if each has its share at most: 30 MB
BLOCK = 2048  # segments that are counted at a time: their samples fit into the processor's cache


@dataclass(frozen=True, slots=True)
class MotionStack:
    """M motions as functions of index and time, each as `TrackFunction` has it.

    values: motions (F,), times (F,) s, before → (F, C). travel: motions, starts, ends (B,) → (B,).
    """

    values: Callable[[Ints, Floats, bool], Floats]
    rotation: bool
    travel: Callable[[Ints, Floats, Floats], Floats] | None = None


class StackedKeys(NamedTuple):
    """Keys of many motions, one motion after the other.

    motion: (K,) index of each key's motion. times: (K,) s. values: (K, C).
    """

    motion: Ints
    times: Floats
    values: Floats


def fit_linear_keys(
    stack: MotionStack, motion: Ints, knots: Floats, *, tolerance: float, most: int = MAX_KEYS
) -> StackedKeys:
    """Return the keys that `adaptive_keys.linear_keys` gives each motion, equal to the bit.

    motion, knots: (T,) index and time of each knot; by motion, increasing times within each. Motions that need more
    keys than their share of MAX_STACK_KEYS, or than `most`, are omitted: memory stays that of the others.
    """
    limit = min(MAX_KEYS, most, MAX_STACK_KEYS // (len(np.flatnonzero(np.diff(motion))) + 1))
    motion, times = _split_by_travel(stack, motion, knots, limit)
    motion, times = _refine(stack, motion, times, tolerance, limit)
    if not len(motion):
        return StackedKeys(motion, times, np.zeros((0, 4 if stack.rotation else 3)))
    values = _values(stack, motion, times, False)
    earlier, arriving = just_before(times[1:]), _values(stack, motion[1:], times[1:], True)
    moved = distance(arriving, values[1:], rotation=stack.rotation) > JUMP_TOLERANCE
    jumps = np.flatnonzero(moved & (motion[1:] == motion[:-1]) & (earlier > times[:-1]))
    motion = np.insert(motion, jumps + 1, motion[jumps])
    times = np.insert(times, jumps + 1, earlier[jumps])
    values = np.insert(values, jumps + 1, arriving[jumps], axis=0)
    return StackedKeys(motion, times, quaternion.align_signs(values, motion) if stack.rotation else values)


def distinct_times(motion: Ints, times: Floats) -> tuple[Ints, Floats]:
    """Return the distinct times (T,) of each motion, by motion, then by time."""
    order = np.lexsort((times, motion))
    motion, times = motion[order], times[order]
    new = np.ones(len(times), bool)
    new[1:] = (motion[1:] != motion[:-1]) | (times[1:] != times[:-1])
    return motion[new], times[new]


def _first(motion: Ints) -> Ints:
    """The index (K,) of the first key of each key's motion."""
    starts = np.flatnonzero(np.append(True, motion[1:] != motion[:-1])[: len(motion)])
    return np.repeat(starts, np.diff(np.append(starts, len(motion))))


def _values(stack: MotionStack, motion: Ints, times: Floats, before: bool) -> Floats:
    size = BLOCK * (NUM_LINEAR_SAMPLES + 2)
    parts = [slice(i, i + size) for i in range(0, max(len(times), 1), size)]
    return np.concatenate([stack.values(motion[part], times[part], before) for part in parts])


def _split_by_travel(stack: MotionStack, motion: Ints, knots: Floats, limit: int) -> tuple[Ints, Floats]:
    """The knots, and those that bound the travel between two; without motions that need too many."""
    if stack.travel is None:
        return motion, knots
    segment = np.flatnonzero(motion[1:] == motion[:-1])
    owner, a, b = motion[segment], knots[segment], knots[segment + 1]
    counts = np.maximum(np.ceil(stack.travel(owner, a, b) / MAX_TRAVEL_RAD), 1)
    some = (np.bincount(owner, counts) <= limit)[owner]
    last = np.append(motion[1:] != motion[:-1], True)
    short = np.isin(motion, owner[~some], invert=True)
    part, starts, _ = number_parts(a[some], b[some], counts[some].astype(np.int64))
    return distinct_times(
        np.concatenate((owner[some][part], motion[last & short])), np.concatenate((starts, knots[last & short]))
    )


def _refine(stack: MotionStack, motion: Ints, times: Floats, tolerance: float, limit: int) -> tuple[Ints, Floats]:
    """The times and added ones, as by `adaptive_keys.refine`; without motions that need too many."""
    segment = np.flatnonzero(motion[1:] == motion[:-1])
    owner, a, b = motion[segment], times[segment], times[segment + 1]
    found, total = [(motion, times)], np.bincount(motion)
    for _ in range(MAX_ROUNDS):
        middle = round_to_float32((a + b) / 2)
        some = (middle > a) & (middle < b) & (total[owner] <= limit)
        owner, a, b = owner[some], a[some], b[some]
        if not len(a):
            break
        blocks = [slice(i, i + BLOCK) for i in range(0, len(a), BLOCK)]
        counts = np.concatenate([_count(stack, owner[each], a[each], b[each], tolerance) for each in blocks])
        counts[counts == 1] = 0  # finished
        total += np.bincount(owner, counts, len(total)).astype(np.int64)
        counts[total[owner] > limit] = 0
        part, a, b = number_parts(a, b, counts)
        owner = owner[part]
        found.append((owner, a))
    motion, times = (np.concatenate(parts) for parts in zip(*found, strict=True))
    short = total[motion] <= limit
    return distinct_times(motion[short], times[short])


def _count(stack: MotionStack, owner: Ints, a: Floats, b: Floats, tolerance: float) -> Ints:
    """The number (B,) of segments that those from a to b (B,) need; 1 where no split is needed."""
    at = sample_times(a, b, NUM_LINEAR_SAMPLES)
    values = stack.values(np.repeat(owner, at.shape[1]), at.ravel(), False).reshape(*at.shape, -1)
    values[:, -1] = stack.values(owner, b, True)
    count = rotation_segment_count if stack.rotation else vector_segment_count
    return count(values[:, :, None], tolerance)
