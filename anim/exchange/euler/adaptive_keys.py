"""Adaptive keys: interpolation between them follows a path within a tolerance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from anim.arrays import Bools, Floats, Ints, unique_sorted
from anim.errors import RangeError
from anim.maths import quaternion

MAX_ANGLE_RAD = np.radians(120)  # per segment; above 180° slerp takes the other arc
MAX_TRAVEL_RAD = np.radians(360)  # sum over all axes per segment before sampling, so that samples miss no rotation
TIME_ROUNDING_FRACTION = 1e-4  # fraction of a segment's length that float32 times may add or remove
SAMPLES = np.arange(1, 16) / 16
SAFETY_FACTOR = 1.02  # the greatest error is between samples
MAX_SUBDIVISIONS = 64  # segments that one segment is split into at a time
MAX_KEYS = 2_000_000
MAX_ROUNDS = 40

Travel: TypeAlias = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True, slots=True)
class SampledPath:
    """A value (..., C) at any times (...) in seconds.

    value(times, before): `before` gives the left limit at each time, different at jumps.
    travel(a, b): a bound (B,) of the path length of its angles in radians from a to b (B,); 0 for a path without
    angles.
    turns: True for unit quaternions, so that errors are angles.
    """

    value: Callable[[Floats, bool], Floats]
    travel: Travel
    is_rotation: bool


def adaptive_keys(path: SampledPath, knots: Floats, *, tolerance: float) -> tuple[Floats, Floats]:
    """Return key times (K,) and values (K, C) with slerp, or lerp, within `tolerance` of the path.

    knots: (T,) float32-exact times between which the path is smooth; each one is a key. At a jump of the value there is
    another key at the previous float32 time. No segment rotates by more than 120°; signs are continuous.
    tolerance: radians for rotations, the value's own unit otherwise; > 0.
    XYZ (0, 0, 0) → (90°, 90°, 0) at 0.1° → 15 keys
    Source: the chord error of a segment of length h is about h² · α / 8, so an error e needs √(e / tolerance) segments.
    Raises RangeError for over two million keys.
    """
    times = _follow_path(path, knots, tolerance) if len(knots) > 1 else knots
    values = path.value(times, False)
    earlier = np.nextafter(times[1:].astype(np.float32), np.float32(0)).astype(np.float64)
    arriving = path.value(times[1:], True)
    jumps = np.flatnonzero((_distance(path, arriving, values[1:]) > 1e-7) & (earlier > times[:-1]))
    times = np.insert(times, jumps + 1, earlier[jumps])
    values = np.insert(values, jumps + 1, arriving[jumps], axis=0)
    return times, quaternion.align_signs(values) if path.is_rotation else values


def _follow_path(path: SampledPath, knots: Floats, tolerance: float) -> Floats:
    starts, _ = _split_interval(knots[:-1], knots[1:], np.ceil(path.travel(knots[:-1], knots[1:]) / MAX_TRAVEL_RAD))
    return refine_keys(np.append(starts, knots[-1]), lambda a, b: _required_keys(path, a, b, tolerance))


def refine_keys(times: Floats, wanted: Callable[[Floats, Floats], Ints]) -> Floats:
    """Return times (K,) and added ones, until no segment needs to be split.

    times: (T,) float32-exact. wanted: takes segments from a to b (B,), returns for each the segment count (B,), up to
    MAX_SUBDIVISIONS, to split it into; 1 for none.
    Raises RangeError for over two million keys.
    """
    found, a, b = [times], times[:-1], times[1:]
    for _ in range(MAX_ROUNDS):
        pieces = wanted(a, b)
        middle = _round_to_float32((a + b) / 2)
        again: Bools = (pieces > 1) & (middle > a) & (middle < b)
        if not again.any():
            break
        if pieces[again].sum() + sum(map(len, found)) > MAX_KEYS:
            raise RangeError(f"the motion needs over {MAX_KEYS} keys (raise the tolerance?)")
        a, b = _split_interval(a[again], b[again], pieces[again])
        found.append(a)
    return unique_sorted(np.concatenate(found))


def _required_keys(path: SampledPath, a: Floats, b: Floats, tolerance: float) -> Ints:
    """Segment count (B,) to split each segment into; 1 for none."""
    u = np.concatenate(([0.0], SAMPLES, [1.0]))
    at = a[:, None] + (b - a)[:, None] * u
    at[:, -1] = b
    values = path.value(at, False)
    values[:, -1] = path.value(b, True)
    start, end = values[:, :1], values[:, -1:]
    if path.is_rotation:
        chord = quaternion.slerp(start, end, SAMPLES[None])
        steps = quaternion.angle_between(values[:, 1:], values[:, :-1]).sum(axis=1)
        turns = np.ceil(steps / MAX_ANGLE_RAD - TIME_ROUNDING_FRACTION)
    else:
        chord = start + (end - start) * SAMPLES[None, :, None]
        turns = np.ones(len(a))
    error = _distance(path, chord, values[:, 1:-1]).max(axis=1) * SAFETY_FACTOR
    bent = np.ceil(np.sqrt(error / tolerance) - 1e-9)
    pieces: Ints = np.clip(np.where(turns > 1, turns, bent), 1, MAX_SUBDIVISIONS).astype(np.int64)
    return pieces


def _split_interval(a: Floats, b: Floats, pieces: Ints | Floats) -> tuple[Floats, Floats]:
    """Segments from a to b (B,) split evenly at float32-exact times, without empty ones: starts, ends."""
    counts = np.maximum(pieces, 1)
    if counts.sum() > MAX_KEYS:
        raise RangeError(f"the angles run through so many turns that over {MAX_KEYS} keys are needed")
    counts = counts.astype(np.int64)
    piece = np.repeat(np.arange(len(a)), counts)
    step = np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)
    length = (b - a)[piece] / counts[piece]
    starts = np.where(step == 0, a[piece], _round_to_float32(a[piece] + step * length))
    last = step == counts[piece] - 1
    ends = np.where(last, b[piece], _round_to_float32(a[piece] + (step + 1) * length))
    some = ends > starts
    return starts[some], ends[some]


def _round_to_float32(times: Floats) -> Floats:
    return np.asarray(times.astype(np.float32).astype(np.float64))


def _distance(path: SampledPath, p: Floats, q: Floats) -> Floats:
    return quaternion.angle_between(p, q) if path.is_rotation else np.asarray(np.sqrt(((p - q) ** 2).sum(axis=-1)))
