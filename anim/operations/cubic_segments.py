"""Cubic pieces one after another → the keys of a CUBICSPLINE track, jumps and float32 times included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Interpolation, Track, ValueKind
from anim.sampling.times import distinct_float32

JUMP = 1e-6  # s; a jump takes at least this long, so that it does not become a denormal number near 0 s
SAME = 1e-9  # of the largest value; where pieces meet nearer than this they meet


@dataclass(frozen=True, slots=True)
class CubicSegments:
    """P cubics: from start to end (P,) s, from value0 to value1 (P, C), slopes (P, C) per second at both ends."""

    start: Floats
    end: Floats
    value0: Floats
    value1: Floats
    slope0: Floats
    slope1: Floats


def join_segments(parts: Sequence[CubicSegments]) -> CubicSegments:
    """Return the pieces of all parts in order."""
    return CubicSegments(
        *(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(CubicSegments))
    )


def to_cubicspline(track: Track, pieces: CubicSegments) -> Track:
    """Return `track` with the pieces as CUBICSPLINE keys.

    Where one piece's end is not the next one's start the value jumps between two keys as near as float32 allows.
    Pieces too short for float32 times go; tangents before the first and after the last key are 0.
    """
    if track.kind is ValueKind.ROTATION:
        pieces = _aligned(pieces)
    times = np.append(pieces.start, pieces.end[-1])
    values = np.concatenate((pieces.value0, pieces.value1[-1:]))
    before = np.concatenate((np.zeros_like(pieces.slope1[:1]), pieces.slope1))
    after = np.concatenate((pieces.slope0, np.zeros_like(pieces.slope0[:1])))
    jumps = _jumps(pieces)
    if len(jumps):
        times, values, before, after = _with_jumps(jumps, pieces, times, values, before, after)
    kept = distinct_float32(times)
    in_tangents = before[kept]
    return replace(
        track,
        interpolation=Interpolation.CUBICSPLINE,
        times=times[kept],
        values=values[kept],
        in_tangents=in_tangents,
        out_tangents=after[kept],
    )


def to_step(track: Track, pieces: CubicSegments) -> Track:
    """Return `track` with the start of each piece as a STEP key, and the last end."""
    values = np.concatenate((pieces.value0, pieces.value1[-1:]))
    if track.kind is ValueKind.ROTATION:
        values = quaternion.align_signs(values)
    times = np.append(pieces.start, pieces.end[-1])
    return with_keys(track, times, values, Interpolation.STEP)


def with_keys(track: Track, times: Floats, values: Floats, interpolation: Interpolation) -> Track:
    """Return `track` with these keys and no tangents; keys too near for float32 go."""
    kept = distinct_float32(times)
    return replace(
        track,
        interpolation=interpolation,
        times=times[kept],
        values=values[kept],
        in_tangents=None,
        out_tangents=None,
    )


def _aligned(pieces: CubicSegments) -> CubicSegments:
    """Pieces of quaternions with signs such that each starts on the side on which the last one ended."""
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


def _jumps(pieces: CubicSegments) -> list[int]:
    """Numbers of the pieces that don't start where the one before ended."""
    size = max(float(np.abs(pieces.value0).max()), float(np.abs(pieces.value1).max()), 1e-30)
    off = np.abs(pieces.value1[:-1] - pieces.value0[1:]).max(axis=1)
    return [int(i) + 1 for i in np.flatnonzero(off > SAME * size)]


def _with_jumps(
    jumps: list[int], pieces: CubicSegments, times: Floats, values: Floats, before: Floats, after: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Keys with one more just before each jump, which ends the piece that came before."""
    at = np.array(jumps)
    early = times[at].astype(np.float32)
    early = np.minimum(np.nextafter(early, np.float32(-np.inf)).astype(np.float64), times[at] - JUMP)
    still = np.zeros((len(at), values.shape[1]))
    arriving = before[at].copy()
    before[at] = 0.0
    return (
        np.insert(times, at, early),
        np.insert(values, at, pieces.value1[at - 1], axis=0),
        np.insert(before, at, arriving, axis=0),
        np.insert(after, at, still, axis=0),
    )
