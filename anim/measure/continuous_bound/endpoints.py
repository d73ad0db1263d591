"""One-sided values, slopes and second derivatives of vectors at both ends of every interval."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.maths import hermite
from anim.measure.continuous_bound.derivative_bounds import derivative_bound
from anim.measure.continuous_bound.intervals import IntervalKeys, Intervals
from anim.measure.continuous_bound.node_tracks import NodeTracks, pairs_of
from anim.model import Interpolation
from anim.sampling.batch import Batch
from anim.sampling.lazy_batch import LazyBatch


class Endpoints(NamedTuple):
    """Values, slopes, second derivatives (per s, s²) of vectors at ends of intervals: (2, C, L), or (2, C, U, G).

    Within an interval the third derivative is constant: a line or a cubic. L pairs are those of `node_tracks`.
    """

    value: Floats
    slope: Floats
    bend: Floats


def endpoints(tracks: Sequence[NodeTracks]) -> Endpoints:
    """Return the endpoints (2, C, L) of vectors, all pairs of one clip after those of another."""
    num_pairs = sum(each.num_pairs for each in tracks)
    shape = (2, tracks[0].rest.shape[1], num_pairs)
    found = Endpoints(np.empty(shape), np.zeros(shape), np.zeros(shape))
    for each, pairs in pairs_of(tracks):
        parts = [each.view(whole[..., pairs]) for whole in found]
        parts[0][...] = each.rest.T[:, :, None]
        for lazy in each.tracks:
            rows = each.rows(lazy)
            for part, values in zip(parts, of_batch(*keys_of(lazy, each.where)), strict=True):
                part[..., rows, :] = values
    return found


def keys_of(tracks: LazyBatch, where: Intervals) -> tuple[Batch, IntervalKeys]:
    """Return the keys of tracks in intervals, stacked, and the intervals' positions on these."""
    at = where.on(tracks.time_axis)
    batch, left, right = tracks.at(at.left, at.right)
    return batch, at._replace(left=left, right=right)


def of_batch(batch: Batch, at: IntervalKeys) -> Endpoints:
    """Return the endpoints (2, C, U, G) of a batch's U tracks; rotations not normalized. at: positions on its keys."""
    start, end = batch.values[at.left].T, batch.values[at.right].T  # (C, U, G)
    if batch.interpolation is Interpolation.STEP:
        nothing = np.zeros((2, *start.shape))
        return Endpoints(np.stack((start, start)), nothing, nothing)
    if batch.tangents is not None:
        return _cubic(batch.tangents, at, start, end)
    shares = np.stack((at.start, at.end))[:, None, None]
    slope = np.broadcast_to((end - start) / np.where(at.inside, at.duration, np.inf), (2, *start.shape))
    return Endpoints(start + shares * (end - start), slope, np.zeros_like(slope))


def vector_bounds(of: Endpoints, h: Floats, size: Callable[[Floats], Floats]) -> Floats:
    """Return bounds (3, ...) of the norm of a vector and its first two derivatives in every interval.

    h: (L,) s, the interval's length. size: norm of vectors (C, L); convex.
    """
    bend = np.maximum(*map(size, of.bend))
    jerk = size(of.bend[1] - of.bend[0])  # times the interval's length
    slope = np.maximum(*map(size, of.slope)) + h / 8 * jerk
    return np.stack((np.maximum(*map(size, of.value)) + h * h / 8 * bend, slope, bend))


def slide_bounds(first: Endpoints, second: Endpoints, h: Floats, size: Callable[[Floats], Floats]) -> Floats:
    """Return the majorant (3, 2, ...) of a vector in two versions. h, size: as of `vector_bounds`."""
    apart = Endpoints(second.value - first.value, second.slope - first.slope, second.bend - first.bend)
    return derivative_bound(vector_bounds(first, h, size), vector_bounds(apart, h, size))


def _cubic(tangents: tuple[Floats, Floats], at: IntervalKeys, start: Floats, end: Floats) -> Endpoints:
    arriving, leaving = tangents
    out, into = leaving[at.left].T, arriving[at.right].T
    piece = (start, at.duration * out, end, at.duration * into)
    shares = np.stack((at.start, at.end))[:, None, None]
    whole = np.where(at.inside, at.duration, 1.0)
    value = hermite.evaluate(shares, *piece)
    slope = np.where(at.inside, hermite.first_derivative(shares, *piece) / whole, 0.0)
    bend = np.where(at.inside, hermite.second_derivative(shares, *piece) / whole**2, 0.0)
    return Endpoints(value, slope, bend)
