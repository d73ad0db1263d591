"""Table of segment errors, from which the fewest keys under any budget follow."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, Ints

SPAN_RANGE = (32, 64)  # limits of the keys covered by one segment, else those of a second
MAX_TABLE_VALUES = 40_000_000  # above it, callers use `key_reduction.greedy_keys` per budget
MAX_STACKED_VALUES = 30_000  # tracks × keys tabulated in the same arrays, each 32 bytes in each of three arrays
MAX_COPIED_VALUES = 4_000_000  # of a table that is copied for faster maxima over groups: 16 MB
ERROR_WEIGHT = 1e-3  # of a key: selects the smallest error among equal numbers of keys


def fits(tracks: int, times: Floats) -> bool:
    """Return whether a table for `tracks` tracks with keys at `times` (K,), in seconds, fits in memory."""
    return tracks * len(times) * _span(times) <= MAX_TABLE_VALUES


class Tabulated(NamedTuple):
    """Tracks of a clip to tabulate. values: (G, K, C) in metres. times: (K,) s.

    limit: m; a track's errors of long segments may be infinite where those of all shorter ones of a length exceed it.
    """

    values: Floats
    times: Floats
    limit: float


class SegmentErrors:
    """Largest errors of linear segments between all pairs of K keys up to a second apart, for G tracks.

    errors: (G, K, span) m: at [g, e, n] the largest distance from the line between keys e - n - 1 and e; infinite
    without such a key.
    """

    def __init__(self, errors: NDArray[np.float32]) -> None:
        self._errors = errors

    def __len__(self) -> int:
        """Return the number of keys of each track."""
        return int(self._errors.shape[1])

    @property
    def span(self) -> int:
        """The most intervals that a segment covers."""
        return int(self._errors.shape[2])

    def costs(self, tracks: Ints, budgets: Floats, ends: slice = slice(None)) -> NDArray[np.float32]:
        """Return the costs (K, k, span) of segments that end at each key of the `tracks` (k,) under budgets (k,) in m.

        About 1 within the budget, inf above it and where there is no segment. ends: some of the keys.
        """
        return _costs(self._shares(tracks, budgets, ends)).transpose(1, 0, 2)

    def shared_costs(self, groups: Sequence[Ints], budgets: Floats) -> NDArray[np.float32]:
        """Return the costs (K, A, span) of segments that all tracks of a group have in common, as of `costs`.

        groups: A groups of k tracks in all. budgets: (k,) m, in their order.
        """
        shares = self._shares(np.concatenate(groups), budgets)
        largest = np.empty((len(self), len(groups), self.span), np.float32)
        ends = np.cumsum([len(each) for each in groups]).tolist()
        for n, (each, end) in enumerate(zip(groups, ends, strict=True)):
            shares[end - len(each) : end].max(axis=0, out=largest[:, n])
        return _costs(largest)

    def _shares(self, tracks: Ints, budgets: Floats, ends: slice = slice(None)) -> NDArray[np.float32]:
        """Errors (k, K, span) of some tracks as fractions of their budgets (k,) in m."""
        shares = self._errors[tracks, ends]
        shares *= (1 / budgets).astype(np.float32)[:, None, None]
        return shares

    def reach(self, tracks: Ints, budgets: Floats) -> Ints:
        """Return for each key (k, K) of the `tracks` (k,) the last one that a segment reaches under budgets (k,) in m.

        All shorter segments from there are within it too: what several tracks reach together is the least of them.
        """
        count = len(self)
        longer = np.count_nonzero(self._largest[:, :, tracks] <= budgets, axis=0).T
        return np.asarray(np.minimum(np.arange(1, count + 1) + longer, count - 1))

    @cached_property
    def _largest(self) -> NDArray[np.float32]:
        """[n, s, g]: the largest error of the segments from key s over 2 … n + 2 intervals; infinite past the end."""
        tracks, count, span = self._errors.shape
        largest = np.full((span - 1, count, tracks), np.inf, np.float32)
        for n in range(1, min(span, count - 1)):
            largest[n - 1, : count - n - 1] = self._errors[:, n + 1 :, n].T
        return np.asarray(np.maximum.accumulate(largest, axis=0))


def _costs(shares: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.where(shares <= 1, 1 + ERROR_WEIGHT * shares, np.float32(np.inf))


def tabulate(asked: Sequence[Tabulated]) -> list[SegmentErrors]:
    """Return the errors of each clip's tracks, computed in the same arrays, so many at a time as a cache holds.

    The errors of a clip do not depend on the others.
    """
    found: list[SegmentErrors] = []
    waiting: list[Tabulated] = []
    for each in asked:
        if waiting and _padded_size([*waiting, each]) > MAX_STACKED_VALUES:
            found += _tabulate(waiting)
            waiting = []
        waiting.append(each)
    return found + (_tabulate(waiting) if waiting else [])


def _padded_size(asked: Sequence[Tabulated]) -> int:
    return sum(len(each.values) for each in asked) * max(len(each.times) for each in asked)


def _tabulate(asked: Sequence[Tabulated]) -> list[SegmentErrors]:
    tracks = [len(each.values) for each in asked]
    spans, limits = np.array([_span(each.times) for each in asked]), np.array([each.limit for each in asked])
    # in the order of the loop: what it leaves takes no memory
    tables = [np.empty((_span(at), len(at), len(values)), np.float32) for values, at, _ in asked]
    lengths = [0] * len(asked)
    clip, track = np.repeat(np.arange(len(asked)), tracks), np.concatenate([np.arange(count) for count in tracks])
    components, times = _padded(asked)
    squares: list[Floats] = []  # by length: of the distances between keys
    while len(clip):
        squares.append(_squared_distances(components, len(squares) + 1))
        length = len(squares)
        errors = _segment_errors(squares, times, clip)
        edges = np.searchsorted(clip, np.arange(len(asked) + 1)).tolist()
        for n, (table, first, end) in enumerate(zip(tables, edges, edges[1:], strict=False)):
            if first < end:
                table[length - 1] = np.inf
                table[length - 1, length:, track[first:end]] = errors[first:end, : table.shape[1] - length]
                lengths[n] = length
        # longer segments of the others nearly all exceed it too
        kept = (errors <= limits[clip, None]).any(axis=1) & (spans[clip] > length)
        if not kept.all():
            clip, track, components = clip[kept], track[kept], components[:, kept]
            squares = [each[kept] for each in squares]
    return [SegmentErrors(_by_track(table[:longest])) for table, longest in zip(tables, lengths, strict=True)]


def _by_track(table: NDArray[np.float32]) -> NDArray[np.float32]:
    """The errors (G, K, span) of a table (span, K, G); contiguous for each track unless a copy would be large."""
    errors = table.transpose(2, 1, 0)
    return np.ascontiguousarray(errors) if errors.size <= MAX_COPIED_VALUES else errors


def _padded(asked: Sequence[Tabulated]) -> tuple[Floats, Floats]:
    """Values (C, G, K) of all tracks, nan after a clip's last key, and the clips' times (B, K) in s, increasing."""
    count = max(len(each.times) for each in asked)
    components = np.full((asked[0].values.shape[2], sum(len(each.values) for each in asked), count), np.nan)
    times = np.empty((len(asked), count))
    first = 0
    for n, (values, at, _) in enumerate(asked):
        components[:, first : first + len(values), : len(at)] = np.moveaxis(values, -1, 0)
        times[n] = np.concatenate((at, at[-1] + np.arange(1, count - len(at) + 1)))
        first += len(values)
    return components, times


def _span(times: Floats) -> int:
    duration = float(times[-1] - times[0])
    per_second = int(np.ceil((len(times) - 1) / duration)) if duration > 0 else 1
    return max(min(max(per_second, SPAN_RANGE[0]), SPAN_RANGE[1], len(times) - 1), 1)


def _squared_distances(values: Floats, length: int) -> Floats:
    """Squared distances (G, K - length) of keys `length` intervals apart. values: (C, G, K)."""
    away = values[..., length:] - values[..., : values.shape[2] - length]
    away *= away
    total: Floats = away[0]
    for each in away[1:]:
        total += each
    return total


def _segment_errors(squares: Sequence[Floats], times: Floats, clip: Ints) -> Floats:
    """Errors (G, K - n) of the segments over n intervals, 0 for neighbors.

    squares: n arrays (G, K - 1) … (G, K - n), the squared distances of keys 1 … n intervals apart. times: (B, K) s.
    clip: (G,) index of each track's times.

    Three distances give that of a key from the line at its time, whatever the number of components, by Stewart's
    theorem: (1 - u) a² + u b² - u (1 - u) c², where a and b are from the ends of the segment and c is between these.
    """
    whole, length = squares[-1], len(squares)
    starts = whole.shape[1]
    largest = np.where(np.isnan(whole), np.nan, 0.0)
    part = np.empty_like(whole)
    duration = times[:, length:] - times[:, :starts]
    for inner in range(1, length):
        u = (times[:, inner : inner + starts] - times[:, :starts]) / duration
        u = u[clip] if len(u) > 1 else u
        error = u * squares[length - inner - 1][:, inner:]
        u_of_start = 1 - u
        error += np.multiply(u_of_start, squares[inner - 1][:, :starts], out=part)
        u_of_start *= u
        error -= np.multiply(u_of_start, whole, out=part)
        np.maximum(largest, error, out=largest)
    return np.asarray(np.sqrt(largest))
