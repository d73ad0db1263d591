"""Adaptive keys: segments are split until interpolation follows a motion within a tolerance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats, Ints, unique_sorted
from anim.errors import UnsupportedError
from anim.maths import hermite, quaternion
from anim.model import Interpolation, Track
from anim.sampling.times import distinct_float32, just_before

CUBIC_SAMPLES = np.array(
    [0.03, 0.11, 0.21, 0.32, 0.43, 0.5, 0.57, 0.68, 0.79, 0.89, 0.97]
)  # of a segment; errors can vanish at ½ alone
NUM_LINEAR_SAMPLES = 15  # evenly inside a segment
SAFETY_FACTOR = 1.02  # the greatest error is between samples
MAX_ANGLE_RAD = np.radians(120)  # of one segment; above 180° slerp takes the other arc
MAX_TRAVEL_RAD = np.radians(360)  # sum over all axes per segment before sampling, so that samples miss no rotation
TIME_ROUNDING_FRACTION = 1e-4  # fraction of a segment's length that float32 times may add or remove
JUMP_TOLERANCE = 1e-7  # a larger difference of the value before and at a knot is a jump
MIN_CUBIC_SEGMENT_S = 1e-5  # float32 times below a minute have a finer resolution
MAX_SUBDIVISIONS = 64  # segments that one segment is split into at a time
MAX_KEYS = 500_000
MAX_ROUNDS = 40
BLOCK = 20_000  # segments that are counted at a time, with up to 16 samples each: 30 MB

SegmentCount: TypeAlias = Callable[[Floats, Floats], Ints]  # starts, ends (B,) → (B,); 1 where no split is needed


@dataclass(frozen=True, slots=True)
class TrackFunction:
    """Motion as functions of time.

    values: times (F,) s, before → values (F, C), unit quaternions if `rotation`; `before` gives the left limit at each
    time, different at jumps.
    rates: times (F,), before → change per second just before or just after: (F, C), angular velocity (F, 3) in rad/s
    along the body's own axes for rotations. For cubic keys only.
    travel: starts, ends (B,) → a bound (B,) of the path length of angles between in radians, if these may make whole
    turns between two knots.
    """

    values: Callable[[Floats, bool], Floats]
    rotation: bool
    rates: Callable[[Floats, bool], Floats] | None = None
    travel: Callable[[Floats, Floats], Floats] | None = None


def linear_keys(
    motion: TrackFunction, knots: Floats, *, tolerance: float, limit: int | None = None
) -> tuple[Floats, Floats]:
    """Return key times (K,) and values (K, C) with slerp, or lerp, within `tolerance` of the motion.

    knots: (T,) s, increasing, between which the motion is smooth; each one is a key. At a jump of the value there is
    another key at the previous float32 time. No segment rotates by more than 120°; signs are continuous.
    tolerance: radians for rotations, the value's own unit otherwise; > 0.
    XYZ (0, 0, 0) → (90°, 90°, 0) at 0.1° → 15 keys
    Raises UnsupportedError for over `limit` keys, MAX_KEYS by default, before they are computed.
    """

    def count(a: Floats, b: Floats) -> Ints:
        at = sample_times(a, b, NUM_LINEAR_SAMPLES)
        values = motion.values(at.ravel(), False).reshape(*at.shape, -1)
        values[:, -1] = motion.values(b, True)
        if motion.rotation:
            return rotation_segment_count(values[:, :, None], tolerance)
        return vector_segment_count(values[:, :, None], tolerance)

    limit = MAX_KEYS if limit is None else limit
    times = refine(_split_by_travel(motion, knots, limit), count, limit)
    values = motion.values(times, False)
    earlier = just_before(times[1:])
    arriving = motion.values(times[1:], True)
    jumps = np.flatnonzero(
        (distance(arriving, values[1:], rotation=motion.rotation) > JUMP_TOLERANCE) & (earlier > times[:-1])
    )
    times = np.insert(times, jumps + 1, earlier[jumps])
    values = np.insert(values, jumps + 1, arriving[jumps], axis=0)
    return times, quaternion.align_signs(values) if motion.rotation else values


def cubic_keys(track: Track, motion: TrackFunction, knots: Floats, *, tolerance: float) -> Track:
    """Return `track` with CUBICSPLINE keys that approximate `motion` within `tolerance`."""
    assert motion.rates is not None

    def count(a: Floats, b: Floats) -> Ints:
        return np.where((b - a > MIN_CUBIC_SEGMENT_S) & (_cubic_error(motion, a, b) > tolerance), 2, 1)

    times = refine(knots, count)
    times = times[distinct_float32(times)]
    values = motion.values(times, False)
    before, after = motion.rates(times, True), motion.rates(times, False)
    if motion.rotation:
        values = quaternion.align_signs(values)
        before, after = quaternion.derivative(values, before), quaternion.derivative(values, after)
    steep = np.flatnonzero(_cubic_error(motion, times[:-1], times[1:]) > tolerance)
    _limit_slopes(steep, times, values, before, after)
    before[0], after[-1] = 0.0, 0.0
    return track.with_keys(times, values, before, after, interpolation=Interpolation.CUBICSPLINE)


def _limit_slopes(segments: Ints, times: Floats, values: Floats, before: Floats, after: Floats) -> None:
    """Limit end slopes of segments too short to be split, in place, so that they don't overshoot.

    Where the motion rises vertically, its slopes are far too large for a segment of a float32 step. Source: Fritsch and
    Carlson, 1980.
    """
    length = np.diff(times)[segments, None]
    limit = 3.0 * np.abs(values[segments + 1] - values[segments]) / length
    after[segments] = np.clip(after[segments], -limit, limit)
    before[segments + 1] = np.clip(before[segments + 1], -limit, limit)


def float32_tolerance(track: Track, tolerance: float) -> float:
    """Return the tolerance for vector values, at least four float32 steps of the track's largest value."""
    return max(tolerance, 4 * float(np.spacing(np.float32(np.abs(track.values).max(initial=0.0)))))


def refine(times: Floats, count: SegmentCount, limit: int | None = None, *, block: int = BLOCK) -> Floats:
    """Return times (T,) and added float32-exact ones, until no segment needs to be split.

    count: takes segments from a to b (B,), returns for each the number of segments (B,), up to MAX_SUBDIVISIONS, to
    split it into; 1 for none. block: number of segments that it is asked about at a time.
    Raises UnsupportedError for over `limit` keys, MAX_KEYS by default, before they are computed.
    """
    limit = MAX_KEYS if limit is None else limit
    found, a, b = [times], times[:-1], times[1:]
    for _ in range(MAX_ROUNDS):
        middle = round_to_float32((a + b) / 2)
        splittable = (middle > a) & (middle < b)
        a, b = a[splittable], b[splittable]
        if not len(a):
            break
        counts = np.concatenate([count(a[i : i + block], b[i : i + block]) for i in range(0, len(a), block)])
        again = counts > 1
        if counts[again].sum() + sum(map(len, found)) > limit:
            raise UnsupportedError(
                f"the motion needs over {limit} keys", help="a shorter clip, or a larger tolerance, needs fewer"
            )
        a, b = split_segments(a[again], b[again], counts[again])
        found.append(a)
    return unique_sorted(np.concatenate(found))


def split_segments(a: Floats, b: Floats, counts: Ints) -> tuple[Floats, Floats]:
    """Segments from a to b (B,) split evenly at float32-exact times, without empty ones: starts, ends."""
    return number_parts(a, b, counts)[1:]


def number_parts(a: Floats, b: Floats, counts: Ints) -> tuple[Ints, Floats, Floats]:
    """Return the parts of `split_segments`, and before them the index (P,) of the segment of each."""
    piece = np.repeat(np.arange(len(a)), counts)
    step = np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)
    length = (b - a)[piece] / counts[piece]
    starts = np.where(step == 0, a[piece], round_to_float32(a[piece] + step * length))
    last = step == counts[piece] - 1
    ends = np.where(last, b[piece], round_to_float32(a[piece] + (step + 1) * length))
    some = ends > starts
    return piece[some], starts[some], ends[some]


def sample_times(a: Floats, b: Floats, inner: int) -> Floats:
    """Return times (B, inner + 2), evenly from each a to b (B,), both of them exact."""
    at = a[:, None] + (b - a)[:, None] * (np.arange(inner + 2) / (inner + 1))
    at[:, -1] = b
    return at


def rotation_segment_count(values: Floats, tolerance: float) -> Ints:
    """Return the number (B,) of slerp segments for rotations (B, S, N, 4): N joints at `sample_times`.

    By the angle of a segment if it is too large for one, since its error is meaningless then, else by its error.
    """
    steps = quaternion.angle_between(values[:, 1:], values[:, :-1]).sum(axis=1)
    by_angle = np.ceil(steps / MAX_ANGLE_RAD - TIME_ROUNDING_FRACTION).max(axis=-1, initial=1)
    chord = quaternion.slerp(values[:, :1], values[:, -1:], _inner_fractions(values)[:, None])
    error = quaternion.angle_between(chord, values[:, 1:-1]).max(axis=(1, 2), initial=0.0)
    by_error = segment_count(error * SAFETY_FACTOR, tolerance)
    return np.where(by_angle > 1, np.minimum(by_angle, MAX_SUBDIVISIONS).astype(np.int64), by_error)


def vector_segment_count(values: Floats, tolerance: float) -> Ints:
    """Return the linear segments (B,) that N paths need; values (B, S, N, C) at times of `sample_times`."""
    u = _inner_fractions(values)[:, None, None]
    chord = values[:, :1] + (values[:, -1:] - values[:, :1]) * u
    error = np.sqrt(((chord - values[:, 1:-1]) ** 2).sum(axis=-1)).max(axis=(1, 2), initial=0.0)
    return segment_count(error * SAFETY_FACTOR, tolerance)


def segment_count(error: Floats, tolerance: float) -> Ints:
    """Return the number (B,) of parts to split segments with errors (B,) into, up to MAX_SUBDIVISIONS.

    Source: the chord error of a segment of length h is about h² · α / 8, so an error e needs √(e / tolerance) segments.
    """
    return np.clip(np.ceil(np.sqrt(error / tolerance) - 1e-9), 1, MAX_SUBDIVISIONS).astype(np.int64)


def _inner_fractions(values: Floats) -> Floats:
    last = values.shape[1] - 1
    return np.asarray(np.arange(1, last) / last)


def _split_by_travel(motion: TrackFunction, knots: Floats, limit: int) -> Floats:
    if motion.travel is None or len(knots) < 2:
        return knots
    counts = np.maximum(np.ceil(motion.travel(knots[:-1], knots[1:]) / MAX_TRAVEL_RAD), 1)
    if counts.sum() > limit:
        raise UnsupportedError(f"the angles run through so many turns that over {limit} keys are needed")
    return np.append(split_segments(knots[:-1], knots[1:], counts.astype(np.int64))[0], knots[-1])


def distance(p: Floats, q: Floats, *, rotation: bool) -> Floats:
    """Return the distances (...) of values (..., C): angles in radians of rotations."""
    return quaternion.angle_between(p, q) if rotation else np.asarray(np.sqrt(((p - q) ** 2).sum(axis=-1)))


def _cubic_error(motion: TrackFunction, start: Floats, end: Floats) -> Floats:
    """Greatest error of each cubic segment (B,); infinite if its angle is too large."""
    assert motion.rates is not None
    at = start[:, None] + (end - start)[:, None] * CUBIC_SAMPLES
    true = motion.values(at.ravel(), False).reshape(*at.shape, -1)
    a, b = motion.values(start, False), motion.values(end, False)
    leaving, arriving = motion.rates(start, False), motion.rates(end, True)
    if motion.rotation:
        b = b * np.where(quaternion.dot(a, b) < 0, -1.0, 1.0)[:, None]
        leaving, arriving = quaternion.derivative(a, leaving), quaternion.derivative(b, arriving)
    duration = (end - start)[:, None]
    piece = (each[:, None] for each in (a, duration * leaving, b, duration * arriving))
    fitted = hermite.evaluate(CUBIC_SAMPLES[None, :, None], *piece)
    if not motion.rotation:
        return np.asarray(np.abs(fitted - true).max(axis=(1, 2), initial=0.0))
    error = quaternion.angle_between(quaternion.normalize(fitted), true).max(axis=1)
    angle = quaternion.angle_between(true[:, 1:], true[:, :-1]).sum(axis=1)
    return np.where(angle > MAX_ANGLE_RAD, np.inf, error)


def round_to_float32(times: Floats) -> Floats:
    """Return the nearest times (T,) that float32 holds."""
    return np.asarray(times.astype(np.float32).astype(np.float64))
