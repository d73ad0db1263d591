"""Cubic segments, and their conversion to keys of CUBICSPLINE tracks with jumps and float32 times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from anim.arrays import Floats, Ints
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
    """Return `track` with the segments as CUBICSPLINE keys at times that float32 stores.

    If a segment's end value is not the next one's start value, the value jumps between two keys of the least interval
    in float32. Segments too short for float32 times are left out: the value then jumps too, and keeps that of the time
    which float32 stores exactly, which is that of a key of the source. Unused tangents are 0.
    """
    if track.kind is ValueKind.ROTATION:
        pieces = _align_signs(pieces)
    segments, boundaries = _round_times(pieces)
    keys = _keys(segments, boundaries)
    return track.with_keys(*keys, interpolation=Interpolation.CUBICSPLINE)


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


@dataclass(frozen=True, slots=True)
class _Boundaries:
    """Keys between Q segments and at both ends: times (Q + 1,) exact in float32, values (Q + 1, C)."""

    times: Floats
    values: Floats


def _round_times(pieces: CubicSegments) -> tuple[CubicSegments, _Boundaries]:
    """Segments with float32 times, without those of no length, and the keys between them.

    Slopes are scaled so that each cubic keeps its shape in its new length. A segment that does not begin or end at the
    value of its boundary begins or ends one jump away from it.
    """
    exact = np.append(pieces.start, pieces.end[-1])
    stored = exact.astype(np.float32).astype(np.float64)
    kept = np.flatnonzero(stored[1:] > stored[:-1])
    if not len(kept):  # one key for all
        kept, stored = np.array([0]), np.append(stored[:1], np.nextafter(np.float32(stored[0]), np.float32(np.inf)))
        exact = exact[[0, -1]]
    start, value0, value1 = stored[kept].copy(), pieces.value0[kept].copy(), pieces.value1[kept].copy()
    end = np.append(start[1:], stored[-1])
    slope0 = pieces.slope0[kept] * (pieces.end - pieces.start)[kept, None]  # per segment, until the end
    slope1 = pieces.slope1[kept] * (pieces.end - pieces.start)[kept, None]
    segments = CubicSegments(start, end, value0, value1, slope0, slope1)
    values = np.concatenate((value0, value1[-1:]))
    for k in np.flatnonzero(np.diff(np.concatenate(([-1], kept, [len(pieces.start)]))) > 1):
        values[k] = _value_at_boundary(pieces, exact, stored, kept, int(k))
    boundaries = _Boundaries(np.append(start, stored[-1]), values)
    _separate(segments, boundaries)
    length = (segments.end - segments.start)[:, None]
    np.divide(slope0, length, out=slope0)
    np.divide(slope1, length, out=slope1)
    return segments, boundaries


def _value_at_boundary(pieces: CubicSegments, exact: Floats, stored: Floats, kept: Ints, k: int) -> Floats:
    """Value (C,) at boundary k of the kept segments, beside segments that are left out.

    That of the time which is stored exactly; else the last.
    """
    first = int(kept[k - 1]) + 1 if k else 0
    last = int(kept[k]) if k < len(kept) else len(pieces.start)
    ends = np.arange(first, last + 1)
    same = ends[exact[ends] == stored[ends]]
    i = int(same[0]) if len(same) else last
    value: Floats = pieces.value0[i] if i < len(pieces.start) else pieces.value1[-1]
    return value


def _separate(segments: CubicSegments, boundaries: _Boundaries) -> None:
    """Move the ends of segments, in place, a jump away from boundaries of another value.

    A segment that is too short for that is bent to the boundary's value instead, without overshooting it.
    """
    size = max(float(np.abs(segments.value0).max()), float(np.abs(segments.value1).max()), 1e-30)
    values = boundaries.values
    for i in np.flatnonzero(np.abs(segments.value0 - values[:-1]).max(axis=1) > JUMP_TOLERANCE * size):
        late = float(np.nextafter(np.float32(segments.start[i]), np.float32(np.inf)))
        if late < segments.end[i]:
            segments.start[i] = late
        else:
            _bend(segments, int(i), segments.value0, values[i])
    early = jump_time_before(segments.end).astype(np.float32)
    for i in np.flatnonzero(np.abs(segments.value1 - values[1:]).max(axis=1) > JUMP_TOLERANCE * size):
        if early[i] > segments.start[i]:
            segments.end[i] = early[i]
        else:
            _bend(segments, int(i), segments.value1, values[i + 1])


def _bend(segments: CubicSegments, i: int, ends: Floats, value: Floats) -> None:
    """Give one end of a segment another value, and monotone slopes (Fritsch and Carlson, 1980)."""
    ends[i] = value
    limit = 3.0 * np.abs(segments.value1[i] - segments.value0[i])
    for slopes in (segments.slope0, segments.slope1):
        slopes[i] = np.clip(slopes[i], -limit, limit)


def _keys(segments: CubicSegments, boundaries: _Boundaries) -> tuple[Floats, Floats, Floats, Floats]:
    """Times, values, in-tangents and out-tangents: of the boundaries, and of segment ends apart from them."""
    none = np.zeros_like(boundaries.values)
    into, out = none.copy(), none.copy()
    begins, ends = segments.start > boundaries.times[:-1], segments.end < boundaries.times[1:]
    out[:-1][~begins] = segments.slope0[~begins]
    into[1:][~ends] = segments.slope1[~ends]
    times = np.concatenate((boundaries.times, segments.start[begins], segments.end[ends]))
    order = np.argsort(times, kind="stable")
    late, early = np.zeros_like(segments.value0[begins]), np.zeros_like(segments.value1[ends])
    return (
        times[order],
        np.concatenate((boundaries.values, segments.value0[begins], segments.value1[ends]))[order],
        np.concatenate((into, late, segments.slope1[ends]))[order],
        np.concatenate((out, segments.slope0[begins], early))[order],
    )
