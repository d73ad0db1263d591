"""One-sided values, slopes and second derivatives of vectors at both ends of every interval."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.maths import hermite
from anim.measure.continuous_bound.derivative_bounds import derivative_bound
from anim.measure.continuous_bound.intervals import IntervalKeys, Intervals
from anim.model import Interpolation
from anim.sampling.batch import Batch


class Endpoints(NamedTuple):
    """Values, slopes, second derivatives (per s, s²) of U vectors at ends of G intervals, (2, C, G, U).

    Within an interval the third derivative is constant: a line or a cubic.
    """

    value: Floats
    slope: Floats
    bend: Floats


def endpoints(rest: Floats, tracks: Sequence[Batch], place: Mapping[int, int], where: Intervals) -> Endpoints:
    """Return the endpoints of vectors, `rest` (U, C) without a track.

    place: index of the vector by node index.
    """
    shape = (2, rest.shape[1], len(where), len(rest))
    found = Endpoints(np.broadcast_to(rest.T[:, None], shape).copy(), np.zeros(shape), np.zeros(shape))
    for batch in tracks:
        columns = [place[track.node] for track in batch.tracks if track.node is not None]
        for whole, part in zip((found.value, found.slope, found.bend), of_batch(batch, where), strict=True):
            whole[..., columns] = part
    return found


def of_batch(batch: Batch, where: Intervals) -> tuple[Floats, Floats, Floats]:
    """Return values and two derivatives (2, C, G, U) of a batch's U tracks; rotations not normalized."""
    at = where.on(batch.time_axis)
    start, end = (np.moveaxis(batch.values[k], -1, 0) for k in (at.left, at.right))  # (C, G, U)
    if batch.interpolation is Interpolation.STEP:
        nothing = np.zeros((2, *start.shape))
        return np.stack((start, start)), nothing, nothing
    if batch.tangents is not None:
        return _cubic(batch.tangents, at, start, end)
    shares = np.stack((at.start, at.end))[:, None, :, None]
    whole = np.where(at.inside, at.duration, np.inf)[:, None]
    slope = np.broadcast_to((end - start) / whole, (2, *start.shape))
    return start + shares * (end - start), slope, np.zeros_like(slope)


def vector_bounds(of: Endpoints, lengths: Floats, size: Callable[[Floats], Floats]) -> Floats:
    """Return bounds (3, ...) of the norm of a vector and its first two derivatives in every interval.

    lengths: (G,) s. size: norm of vectors (C, G, U); convex.
    """
    h = lengths[:, None]
    bend = np.maximum(*map(size, of.bend))
    jerk = size(of.bend[1] - of.bend[0])  # times the interval's length
    slope = np.maximum(*map(size, of.slope)) + h / 8 * jerk
    return np.stack((np.maximum(*map(size, of.value)) + h * h / 8 * bend, slope, bend))


def slide_bounds(first: Endpoints, second: Endpoints, lengths: Floats, size: Callable[[Floats], Floats]) -> Floats:
    """Return the majorant (3, 2, ...) of a vector in two versions. lengths, size: as of `vector_bounds`."""
    apart = Endpoints(second.value - first.value, second.slope - first.slope, second.bend - first.bend)
    return derivative_bound(vector_bounds(first, lengths, size), vector_bounds(apart, lengths, size))


def _cubic(
    tangents: tuple[Floats, Floats], at: IntervalKeys, start: Floats, end: Floats
) -> tuple[Floats, Floats, Floats]:
    arriving, leaving = tangents
    duration = at.duration[:, None]
    out, into = np.moveaxis(leaving[at.left], -1, 0), np.moveaxis(arriving[at.right], -1, 0)
    piece = (start, duration * out, end, duration * into)
    shares = np.stack((at.start, at.end))[:, None, :, None]
    inside = at.inside[:, None]
    whole = np.where(inside, duration, 1.0)
    value = hermite.evaluate(shares, *piece)
    slope = np.where(inside, hermite.first_derivative(shares, *piece) / whole, 0.0)
    bend = np.where(inside, hermite.second_derivative(shares, *piece) / whole**2, 0.0)
    return value, slope, bend
