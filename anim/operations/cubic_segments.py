"""Cubic segments, and their conversion to keys of CUBICSPLINE tracks with jumps and float32 times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Interpolation, Track, ValueKind
from anim.sampling.times import distinct_float32, jump_time_before

JUMP_TOLERANCE = 1e-9  # of the largest value; smaller differences between segments are no jumps


@dataclass(frozen=True, slots=True)
class CubicSegments:
    """P cubics from start to end (P,) s, from value0 to value1 (P, C), with end slopes (P, C) per second."""

    start: Floats
    end: Floats
    value0: Floats
    value1: Floats
    slope0: Floats
    slope1: Floats


def join_segments(parts: Sequence[CubicSegments]) -> CubicSegments:
    """Return the segments of all parts in order."""
    return CubicSegments(
        *(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(CubicSegments))
    )


def to_cubicspline(track: Track, pieces: CubicSegments) -> Track:
    """Return `track` with the segments as CUBICSPLINE keys.

    If a segment's end value is not the next one's start value, the value jumps between two keys of the least interval
    in float32. Segments too short for float32 times are removed; unused tangents at both ends are 0.
    """
    if track.kind is ValueKind.ROTATION:
        pieces = _align_signs(pieces)
    times = np.append(pieces.start, pieces.end[-1])
    values = np.concatenate((pieces.value0, pieces.value1[-1:]))
    before = np.concatenate((np.zeros_like(pieces.slope1[:1]), pieces.slope1))
    after = np.concatenate((pieces.slope0, np.zeros_like(pieces.slope0[:1])))
    jumps = _find_jumps(pieces)
    if len(jumps):
        times, values, before, after = _insert_jump_keys(jumps, pieces, times, values, before, after)
    kept = distinct_float32(times)
    spline = Interpolation.CUBICSPLINE
    return track.with_keys(times[kept], values[kept], before[kept], after[kept], interpolation=spline)


def to_step(track: Track, pieces: CubicSegments) -> Track:
    """Return `track` with the start of each segment, and the last end, as STEP keys."""
    values = np.concatenate((pieces.value0, pieces.value1[-1:]))
    if track.kind is ValueKind.ROTATION:
        values = quaternion.align_signs(values)
    times = np.append(pieces.start, pieces.end[-1])
    return with_distinct_keys(track, times, values, Interpolation.STEP)


def with_distinct_keys(track: Track, times: Floats, values: Floats, interpolation: Interpolation) -> Track:
    """Return `track` with these keys and no tangents; keys with equal float32 times are removed."""
    kept = distinct_float32(times)
    return track.with_keys(times[kept], values[kept], interpolation=interpolation)


def _align_signs(pieces: CubicSegments) -> CubicSegments:
    """Quaternion segments with aligned signs: each starts in the hemisphere of the previous end."""
    inside = np.where(quaternion.dot(pieces.value0, pieces.value1) < 0, -1.0, 1.0)
    between = np.where(quaternion.dot(pieces.value1[:-1], pieces.value0[1:]) < 0, -1.0, 1.0)
    start = np.cumprod(np.concatenate(([1.0], between * inside[:-1])))[:, None]
    end = start * inside[:, None]
    return CubicSegments(
        pieces.start,
        pieces.end,
        pieces.value0 * start,
        pieces.value1 * end,
        pieces.slope0 * start,
        pieces.slope1 * end,
    )


def _find_jumps(pieces: CubicSegments) -> list[int]:
    """Indices of the segments with a start value other than the previous end value."""
    size = max(float(np.abs(pieces.value0).max()), float(np.abs(pieces.value1).max()), 1e-30)
    off = np.abs(pieces.value1[:-1] - pieces.value0[1:]).max(axis=1)
    return [int(i) + 1 for i in np.flatnonzero(off > JUMP_TOLERANCE * size)]


def _insert_jump_keys(
    jumps: list[int], pieces: CubicSegments, times: Floats, values: Floats, before: Floats, after: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Keys with one more just before each jump, as the end of the previous segment."""
    at = np.array(jumps)
    early = jump_time_before(times[at])
    still = np.zeros((len(at), values.shape[1]))
    arriving = before[at].copy()
    before[at] = 0.0
    return (
        np.insert(times, at, early),
        np.insert(values, at, pieces.value1[at - 1], axis=0),
        np.insert(before, at, arriving, axis=0),
        np.insert(after, at, still, axis=0),
    )
