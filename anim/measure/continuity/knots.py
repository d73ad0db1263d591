"""One-sided values, velocities and accelerations of a track at its keys, computed analytically."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hermite, quaternion
from anim.model import Interpolation, Track, ValueKind
from anim.sampling import derivatives
from anim.sampling.times import FLOAT32_SPACING, MAX_JUMP_S
from anim.sampling.track import sample

GAUSS = (0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15))  # u of Gauss-Legendre quadrature, exact up to degree 5
GAUSS_WEIGHTS = (5 / 18, 8 / 18, 5 / 18)


@dataclass(frozen=True, slots=True)
class Knots:
    """J knots, where one segment of a track ends and the next one starts.

    times: (J,) s, of the later key if two represent a jump. Pairs are before and after: values (J, C), rates and
    accelerations (J, D) per second and second², durations (J,) s of the segments, infinite without a segment.
    """

    times: Floats
    values: tuple[Floats, Floats]
    rates: tuple[Floats, Floats]
    accelerations: tuple[Floats, Floats]
    durations: tuple[Floats, Floats]


def interior_knots(track: Track) -> Knots:
    """Return the knots at the interior keys of a track.

    A jump at an end has the inner velocity on both sides.
    """
    keys, steps = track.times, np.append(np.diff(track.times), np.inf)
    borders = np.concatenate(([-1], _segments(track), [len(keys) - 1]))
    first, last = borders[:-1] + 1, borders[1:]
    inside = (last > 0) & (first < len(keys) - 1)
    first, last = first[inside], last[inside]
    left = first - 1
    at_start, at_end = left < 0, last == len(keys) - 1
    stepped = track.interpolation is Interpolation.STEP
    return Knots(
        keys[last],
        (track.values[np.maximum(left, 0) if stepped else first], track.values[last]),
        _one_sided(
            derivatives.rates(track, keys[first], before=True),
            derivatives.rates(track, keys[last], before=False),
            at_start,
            at_end,
        ),
        _one_sided(
            accelerations(track, keys[first], before=True),
            accelerations(track, keys[last], before=False),
            at_start,
            at_end,
        ),
        (np.where(at_start, np.inf, steps[left]), np.where(at_end, np.inf, steps[last])),
    )


def loop_knot(track: Track, *, start: float, end: float) -> Knots:
    """Return the knot between a clip's end and its start, in seconds.

    Outside its keys a track is constant. A STEP track has two knots: a loop shows the value before the last key until
    the end, a player that stops shows the last.
    """
    ends, starts = np.array([end]), np.array([start])
    shown = ends
    if track.interpolation is Interpolation.STEP:
        shown = np.array([end - MAX_JUMP_S - 2 * FLOAT32_SPACING * end, end])
        ends, starts = np.array([end, end]), np.array([start, start])
    return Knots(
        ends,
        (sample(track, shown), sample(track, starts)),
        (derivatives.rates(track, ends, before=True), derivatives.rates(track, starts, before=False)),
        (accelerations(track, ends, before=True), accelerations(track, starts, before=False)),
        (_duration_at(track, ends, before=True), _duration_at(track, starts, before=False)),
    )


def accelerations(track: Track, times: Floats, *, before: bool) -> Floats:
    """Return second derivatives (F, D) per second² just before or after each time; 0 for slerp and lines.

    Of rotations the angular acceleration about the node's own axes: ω = 2 vec(q* q′) / |q|², so
    ω′ = 2 vec(q* q″) / |q|² − 2 ω (q · q′) / |q|², since q′* q′ has no vector part.
    """
    keys, rotation = track.times, track.kind is ValueKind.ROTATION
    result = np.zeros((len(times), 3 if rotation else track.values.shape[1]))
    if track.in_tangents is None or track.out_tangents is None:
        return result
    left = np.searchsorted(keys, times, side="left" if before else "right") - 1
    inside: Bools = (left >= 0) & (left < len(keys) - 1)
    k = left[inside]
    h = (keys[k + 1] - keys[k])[:, None]
    u = (times[inside] - keys[k])[:, None] / h
    piece = track.values[k], h * track.out_tangents[k], track.values[k + 1], h * track.in_tangents[k + 1]
    second = hermite.second_derivative(u, *piece) / h**2
    if rotation:
        q, first = hermite.evaluate(u, *piece), hermite.first_derivative(u, *piece) / h
        inverse, squared = quaternion.conjugate(q), quaternion.dot(q, q)[:, None]
        omega = 2 * quaternion.multiply(inverse, first)[:, :3] / squared
        pulled = 2 * quaternion.multiply(inverse, second)[:, :3]
        second = (pulled - 2 * omega * quaternion.dot(q, first)[:, None]) / squared
    result[inside] = second
    return result


def root_mean_squares(track: Track) -> tuple[float, float]:
    """Return RMS speed and acceleration over all segments; jumps have no duration."""
    pieces = _segments(track)
    steps = np.diff(track.times)[pieces]
    if not len(steps) or track.interpolation is Interpolation.STEP:
        return 0.0, 0.0
    at = (track.times[pieces] + np.outer(GAUSS, steps)).reshape(-1)
    weights = np.outer(GAUSS_WEIGHTS, steps).reshape(-1) / steps.sum()
    squares = (derivatives.rates(track, at, before=False) ** 2, accelerations(track, at, before=False) ** 2)
    speed, acceleration = (float(weights @ square.sum(axis=1)) ** 0.5 for square in squares)
    return speed, acceleration


def lengths(vectors: Floats) -> Floats:
    """Return the lengths (...) of vectors (..., D)."""
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=-1)))


def _segments(track: Track) -> Ints:
    """Indices of the segments between keys that are no jumps: (P,)."""
    return np.flatnonzero(np.diff(track.times) > MAX_JUMP_S + 2 * FLOAT32_SPACING * track.times[1:])


def _one_sided(before: Floats, after: Floats, at_start: Bools, at_end: Bools) -> tuple[Floats, Floats]:
    return np.where(at_start[:, None], after, before), np.where(at_end[:, None], before, after)


def _duration_at(track: Track, times: Floats, *, before: bool) -> Floats:
    """Durations (F,) of the segments just before or just after times (F,), infinite outside the keys."""
    k = np.searchsorted(track.times, times, side="left" if before else "right")
    return np.diff(track.times, prepend=-np.inf, append=np.inf)[k]
