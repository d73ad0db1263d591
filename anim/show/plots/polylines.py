"""Polylines of tracks: values, speeds, handles, with breaks at jumps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, unique_sorted
from anim.maths import quaternion
from anim.measure.continuity.knots import lengths
from anim.model import Interpolation, Track, ValueKind
from anim.sampling import derivatives
from anim.sampling.times import FLOAT32_SPACING, MAX_JUMP_S
from anim.sampling.track import sample

NUM_LINE_POINTS = 800  # of a line: one for each pixel of a wide panel
MAX_SEGMENT_POINTS, MIN_SEGMENT_POINTS = 40, 2  # points of one piece
DENSE_KEYS = 100_000  # over a hundred in each pixel: points between them are not seen
DENSE_SPANS = 8 * NUM_LINE_POINTS  # of a line with more points than dense keys have


@dataclass(frozen=True, slots=True)
class Polyline:
    """Points (P,) s and (P, C); NaN at breaks."""

    times: Floats
    values: Floats


def value_line(track: Track) -> Polyline:
    """Return the values of a track; STEP breaks at every key."""
    if track.interpolation is Interpolation.STEP:
        return _holds(track)
    if track.interpolation is Interpolation.LINEAR and track.kind is not ValueKind.ROTATION:
        return Polyline(track.times, track.values)
    times = track.times if is_dense(track) else _points(track, pieces_only=False)[0].reshape(-1)
    return Polyline(times, sample(track, times))


def step_edges(track: Track) -> Polyline:
    """Return the jumps of a STEP track as separate vertical lines."""
    keys = np.flatnonzero((np.diff(track.values, axis=0) != 0).any(axis=1)) + 1
    blank = np.full((len(keys), 1, track.values.shape[1]), np.nan)
    values = np.concatenate((track.values[keys - 1][:, None], track.values[keys][:, None], blank), axis=1)
    return Polyline(np.repeat(track.times[keys], 3), values.reshape(-1, track.values.shape[1]))


def speed_line(track: Track) -> Polyline:
    """Return the speed of a track (P, 1) per second, rad/s for rotations, true on both sides of every key.

    It breaks where the value jumps; a STEP track has none.
    """
    if track.interpolation is Interpolation.STEP or len(track.times) == 1:
        return Polyline(np.zeros(0), np.zeros((0, 1)))
    times, jumps = _points(track, pieces_only=True)
    if not len(times):  # nothing but jumps
        return Polyline(np.zeros(0), np.zeros((0, 1)))
    speeds = np.empty(times.shape)
    speeds[:, :-1] = lengths(derivatives.rates(track, times[:, :-1].reshape(-1), before=False)).reshape(len(times), -1)
    speeds[:, -1] = lengths(derivatives.rates(track, times[:, -1], before=True))
    blank = np.full((len(times), 1), np.nan)
    times = np.concatenate((times, times[:, -1:]), axis=1)
    speeds = np.concatenate((speeds, np.where(jumps[:, None], blank, speeds[:, -1:])), axis=1)
    return Polyline(times.reshape(-1), speeds.reshape(-1, 1))


def angle_line(track: Track, start: Floats) -> Polyline:
    """Return the angle (P, 1) in rad, 0 … π, of a rotation from another: start (4,)."""
    line = value_line(track)
    first = quaternion.normalize(start[None])
    broken: Bools = np.isnan(line.values[:, 0])
    whole = quaternion.normalize(np.where(broken[:, None], first, line.values))
    angle = quaternion.angle_between(np.broadcast_to(first, whole.shape), whole)
    return Polyline(line.times, np.where(broken, np.nan, angle)[:, None])


def difference_line(track: Track, other: Track) -> Polyline:
    """Return the difference (P, 1) of two tracks of one target, rad for rotations, over the time of both."""
    start, end = min(track.times[0], other.times[0]), max(track.times[-1], other.times[-1])
    keys = np.concatenate((track.times, other.times, np.linspace(start, end, NUM_LINE_POINTS)))
    times = unique_sorted(keys)
    a, b = sample(track, times), sample(other, times)
    off = quaternion.angle_between(a, b) if track.kind is ValueKind.ROTATION else lengths(a - b)
    return Polyline(times, off[:, None])


def handles(track: Track) -> tuple[Floats, Floats]:
    """Return the Bézier handles of a CUBICSPLINE track, from the key: times (H, 2), values (H, 2, C)."""
    if track.in_tangents is None or track.out_tangents is None:
        return np.zeros((0, 2)), np.zeros((0, 2, track.values.shape[1]))
    third = np.diff(track.times) / 3
    leaving_t = np.stack((track.times[:-1], track.times[:-1] + third), axis=1)
    leaving = np.stack((track.values[:-1], track.values[:-1] + third[:, None] * track.out_tangents[:-1]), axis=1)
    arriving_t = np.stack((track.times[1:], track.times[1:] - third), axis=1)
    arriving = np.stack((track.values[1:], track.values[1:] - third[:, None] * track.in_tangents[1:]), axis=1)
    return np.concatenate((leaving_t, arriving_t)), np.concatenate((leaving, arriving))


def is_dense(track: Track) -> bool:
    """Return whether a track has so many keys that points between them are not seen."""
    return len(track.times) > DENSE_KEYS


def keep_extremes(line: Polyline) -> Polyline:
    """Return the least and largest values in short spans of a line of very many points; of fewer the line itself.

    Drawn, they look the same, but for jumps, which are joined.
    """
    count, width = line.values.shape
    if count <= 4 * DENSE_KEYS:  # points at each key, as of tracks that are not dense
        return line
    starts = np.arange(0, count, -(-count // DENSE_SPANS))
    extremes = [part.reduceat(line.values, starts, axis=0) for part in (np.fmin, np.fmax)]  # NaN only where all are
    times = line.times[np.stack((starts, np.append(starts[1:], count) - 1), axis=1)]
    return Polyline(times.reshape(-1), np.stack(extremes, axis=1).reshape(-1, width))


def _points(track: Track, *, pieces_only: bool) -> tuple[Floats, Bools]:
    """Times (P, m) within every segment, both ends included, and a mask (P,) of those followed by a jump."""
    steps = np.diff(track.times)
    real = np.asarray(steps > MAX_JUMP_S + 2 * FLOAT32_SPACING * track.times[1:])
    chosen = np.flatnonzero(real) if pieces_only else np.arange(len(steps))
    straight = track.interpolation is Interpolation.LINEAR and (pieces_only or track.kind is not ValueKind.ROTATION)
    count = (
        MIN_SEGMENT_POINTS
        if straight or is_dense(track)
        else int(np.clip(NUM_LINE_POINTS // max(len(chosen), 1), 4, MAX_SEGMENT_POINTS))
    )
    shares = np.linspace(0, 1, count)
    times = track.times[chosen][:, None] + steps[chosen][:, None] * shares
    times[:, -1] = track.times[chosen + 1]
    return times, np.append(~real, True)[np.minimum(chosen + 1, len(steps))]


def _holds(track: Track) -> Polyline:
    keys, width = len(track.times), track.values.shape[1]
    if keys == 1:
        return Polyline(track.times, track.values)
    times = np.stack((track.times[:-1], track.times[1:], track.times[1:]), axis=1)
    values = np.full((keys - 1, 3, width), np.nan)
    values[:, :2] = track.values[:-1, None]
    return Polyline(times.reshape(-1), values.reshape(-1, width))
