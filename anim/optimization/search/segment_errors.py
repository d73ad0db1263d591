"""Table of segment errors, for the fewest keys under any budget."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Bools, Floats, Ints
from anim.curves.fitting.key_reduction import KEYS_PER_PART

SPAN_RANGE = (32, 64)  # limits of the keys covered by one segment, else those of a second
MAX_TABLE_VALUES = 40_000_000  # above it, callers use `key_reduction.greedy_keys` per budget
MAX_STACKED_VALUES = 8_000_000  # of a table, in one call
ERROR_WEIGHT = 1e-3  # of a key: selects the smallest error among equal numbers of keys


def fits(tracks: int, times: Floats) -> bool:
    """Return whether a table for `tracks` tracks with keys at `times` (K,), in seconds, fits in memory."""
    return tracks * len(times) * _span(times) <= MAX_TABLE_VALUES


class SegmentErrors:
    """Largest errors of linear segments between all pairs of K keys up to a second apart, for G tracks.

    values: (G, K, C) in metres. times: (K,) s. limit: m; larger errors may be approximate.
    """

    def __init__(self, values: Floats, times: Floats, limit: float) -> None:
        tracks, count, _ = values.shape
        self._count = count
        span = _span(times)
        errors = np.empty((span, count, tracks), np.float32)  # in the order of the loop: what it leaves takes no memory
        bent = np.arange(tracks)
        components = np.ascontiguousarray(np.moveaxis(values, -1, 0))
        longest = 0
        while longest < span and len(bent):
            longest += 1
            error = _segment_error(components, times, longest)
            errors[longest - 1] = np.inf
            errors[longest - 1, longest:, bent] = error
            kept = (error <= limit).any(axis=1)  # longer segments of the others nearly all exceed it too
            if not kept.all():
                bent, components = bent[kept], components[:, kept]
        # [e, g, n]: largest distance from the line between keys e - n - 1 and e; infinite without such a key
        self._errors = errors[:longest].transpose(1, 2, 0)

    def greedy_keys(self, tracks: Ints, budgets: Floats) -> Bools:
        """Return the keys (k, K) of the `tracks` (k,) so that no segment's error exceeds the budget (k,) in m."""
        keep = np.ones((len(tracks), self._count), np.bool_)
        parts = max(MAX_STACKED_VALUES // (len(tracks) * self._errors.shape[2] * KEYS_PER_PART), 1)
        for start in range(1, self._count, parts * KEYS_PER_PART):
            stacked = slice(start, start + parts * KEYS_PER_PART)
            shares = self._errors[stacked, tracks] * (1 / budgets).astype(np.float32)[:, None]
            costs = np.where(shares <= 1, 1 + ERROR_WEIGHT * shares, np.float32(np.inf))
            keep[:, stacked] = _fewest_keys(costs)
        return keep


def _fewest_keys(costs: NDArray[np.float32]) -> Bools:
    """Keys (k, n) after a first one on the paths of least cost to the last one, through those between two parts.

    costs: (n, k, span) of the segments that end at each key; inf where none does. All parts are searched at once.
    """
    count, tracks, span = costs.shape
    length = min(count, KEYS_PER_PART)
    parts = -(-count // length)
    missing = np.full((parts * length - count, tracks, span), np.inf, np.float32)
    rows = np.concatenate((costs, missing)) if len(missing) else costs
    rows = rows.reshape(parts, length, tracks, span).transpose(1, 2, 0, 3).reshape(length, tracks * parts, span)
    total = np.full((tracks * parts, length + 1), np.inf, np.float32)
    total[:, 0] = 0
    came = np.zeros((tracks * parts, length + 1), np.int64)
    every = np.arange(tracks * parts)
    for end in range(1, length + 1):
        width = min(span, end)
        totals = total[:, end - width : end][:, ::-1] + rows[end - 1, :, :width]
        best = totals.argmin(axis=1)
        total[:, end] = totals[every, best]
        came[:, end] = end - 1 - best
    last = np.tile(np.append(np.full(parts - 1, length), count - (parts - 1) * length), tracks)
    return _trace(came, last)[:, 1:].reshape(tracks, parts * length)[:, :count]


def _span(times: Floats) -> int:
    duration = float(times[-1] - times[0])
    per_second = int(np.ceil((len(times) - 1) / duration)) if duration > 0 else 1
    return max(min(max(per_second, SPAN_RANGE[0]), SPAN_RANGE[1], len(times) - 1), 1)


def _segment_error(values: Floats, times: Floats, length: int) -> Floats:
    """Errors of segments over `length` intervals (G, K - length), 0 for neighbors; values: (C, G, K)."""
    starts = values.shape[2] - length
    largest = np.zeros((values.shape[1], starts))
    a = values[..., :starts]
    change = values[..., length:] - a
    whole = times[length:] - times[:starts]
    error = np.empty_like(a)
    for inner in range(1, length):
        np.multiply((times[inner : inner + starts] - times[:starts]) / whole, change, out=error)
        error += a
        error -= values[..., inner : inner + starts]
        error *= error
        np.maximum(largest, error.sum(axis=0), out=largest)
    return np.asarray(np.sqrt(largest))


def _trace(came: Ints, last: Ints) -> Bools:
    """Mask (R, K) of the keys on the optimal paths, traced back in `came` (R, K) from the keys `last` (R,)."""
    keep = np.zeros(came.shape, np.bool_)
    for row, at, kept in zip(came, last.tolist(), keep, strict=True):
        before = row.tolist()
        path = []
        while at:
            path.append(at)
            at = before[at]
        kept[path] = True
    return keep
