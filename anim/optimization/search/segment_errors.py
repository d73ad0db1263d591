"""The fewest keys for any budget: what every straight segment of every track misses is worked out once."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats, Ints

SPANS = (32, 64)  # keys that one segment covers at most: those of a second, but no fewer and no more than these
MAX_SPAN = 40_000_000  # numbers in a table; beyond, callers search anew for each budget (`keys.needed`)
NEATNESS = 1e-3  # of a key: among the ways with fewest keys the one that misses least is taken


def fits(tracks: int, times: Floats) -> bool:
    """Return whether a table for so many tracks with keys at `times` (K,), in seconds, is affordable."""
    return tracks * len(times) * _span(times) <= MAX_SPAN


class SegmentErrors:
    """What lines between two keys miss of a track, for G tracks and all pairs of their K keys up to a second apart.

    values: (G, K, C) in metres. times: (K,) s. limit: m; of segments that miss more it doesn't matter how much.
    """

    def __init__(self, values: Floats, times: Floats, limit: float) -> None:
        tracks, count, _ = values.shape
        self._count = count
        span = _span(times)
        # missed[e, g, n]: largest distance from the line between keys e - n - 1 and e; infinite where there is none
        self._missed = np.full((count, tracks, span), np.inf, np.float32)
        bent = np.arange(tracks)
        for n in range(span):
            missed = _segment_error(values[bent], times, n + 1)
            self._missed[n + 1 :, bent, n] = missed.T
            bent = bent[(missed <= limit).any(axis=1)]  # if all segments miss by too much, so do nearly all longer ones

    def greedy_keys(self, tracks: Ints, budgets: Floats) -> Bools:
        """Return which keys (k, K) the `tracks` (k,) must keep so that lines miss none by over its budget (k,) in m."""
        shares = self._missed[:, tracks] * (1 / budgets).astype(np.float32)[:, None]
        span = shares.shape[2]
        costs = np.where(shares <= 1, 1 + NEATNESS * shares, np.float32(np.inf))
        total = np.full((len(tracks), self._count), np.inf, np.float32)
        total[:, 0] = 0
        came = np.zeros((len(tracks), self._count), np.int64)
        every = np.arange(len(tracks))
        for end in range(1, self._count):
            width = min(span, end)
            ways = total[:, end - width : end][:, ::-1] + costs[end, :, :width]
            best = ways.argmin(axis=1)
            total[:, end] = ways[every, best]
            came[:, end] = end - 1 - best
        return _trace(came)


def _span(times: Floats) -> int:
    duration = float(times[-1] - times[0])
    per_second = int(np.ceil((len(times) - 1) / duration)) if duration > 0 else 1
    return max(min(max(per_second, SPANS[0]), SPANS[1], len(times) - 1), 1)


def _segment_error(values: Floats, times: Floats, length: int) -> Floats:
    """What segments over `length` gaps miss (G, K - length), 0 for neighbors."""
    starts = values.shape[1] - length
    largest = np.zeros((len(values), starts))
    a, b = values[:, :starts], values[:, length:]
    whole = times[length:] - times[:starts]
    for inner in range(1, length):
        share = ((times[inner : inner + starts] - times[:starts]) / whole)[:, None]
        off = a + share * (b - a) - values[:, inner : inner + starts]
        np.maximum(largest, np.einsum("gkc,gkc->gk", off, off), out=largest)
    return np.asarray(np.sqrt(largest))


def _trace(came: Ints) -> Bools:
    """Which keys (k, K) lie on the ways that `came` (k, K) leads back along, from the last key to the first."""
    tracks, count = came.shape
    keep = np.zeros((tracks, count), np.bool_)
    at = np.full(tracks, count - 1)
    every = np.arange(tracks)
    keep[:, 0] = True
    while at.any():
        keep[every, at] = True
        at = came[every, at]
    return keep
