"""The fewest keys of tracks under any budget, from tables of segment errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Bools, Floats, Ints
from anim.curves.fitting.key_reduction import KEYS_PER_PART
from anim.optimization.search.segment_errors import SegmentErrors

MAX_JOINT_TABLE_VALUES = 1_000_000  # of several tables in one search: 4 MB


def greedy_keys(asked: Sequence[tuple[SegmentErrors, Ints, Floats]]) -> list[Bools]:
    """Return the keys (k, K) of the tracks (k,) of each table, so that no segment's error exceeds its budget (k,) in m.

    Tables are searched together, so many at a time as memory allows.
    """
    found: list[Bools] = []
    waiting: list[NDArray[np.float32]] = []
    for errors, tracks, budgets in asked:
        is_long = len(errors) > KEYS_PER_PART
        size = len(errors), len(tracks), errors.span
        if waiting and (is_long or _stacked_size(waiting, size) > MAX_JOINT_TABLE_VALUES):
            found += _stacked_keys(waiting)
            waiting = []
        if is_long:
            found.append(_keys_of_parts(errors, tracks, budgets))
        else:
            waiting.append(errors.costs(tracks, budgets))
    return found + (_stacked_keys(waiting) if waiting else [])


def shared_keys(asked: Sequence[tuple[SegmentErrors, Sequence[Ints], Floats]]) -> list[Bools]:
    """Return the keys (A, K) of the groups of tracks of each table, so that no segment exceeds a budget of its tracks.

    Groups and budgets are those of `SegmentErrors.shared_costs`; tables have up to KEYS_PER_PART keys.
    """
    found: list[Bools] = []
    waiting: list[NDArray[np.float32]] = []
    for errors, groups, budgets in asked:
        if waiting and _stacked_size(waiting, (len(errors), len(groups), errors.span)) > MAX_JOINT_TABLE_VALUES:
            found += _stacked_keys(waiting)
            waiting = []
        waiting.append(errors.shared_costs(groups, budgets))
    return found + (_stacked_keys(waiting) if waiting else [])


def _stacked_size(waiting: Sequence[NDArray[np.float32]], size: tuple[int, ...]) -> int:
    """Values of tables of costs (K, k, span) in one array with another one of this size."""
    counts, widths, spans = zip(size, *(costs.shape for costs in waiting), strict=True)
    return int(max(counts) * sum(widths) * max(spans))


def _stacked_keys(tables: Sequence[NDArray[np.float32]]) -> list[Bools]:
    """The keys (k, K) of each table of costs (K, k, span): the first, and those on the paths of least cost."""
    if len(tables) == 1:
        costs = tables[0]
        return [_fewest_keys(costs[1:], np.full(costs.shape[1], len(costs) - 1))]
    counts = [len(costs) for costs in tables]
    tracks = [costs.shape[1] for costs in tables]
    stacked = np.full((max(counts), sum(tracks), max(costs.shape[2] for costs in tables)), np.inf, np.float32)
    ends = np.cumsum(tracks)
    for costs, end in zip(tables, ends.tolist(), strict=True):
        stacked[: len(costs), end - costs.shape[1] : end, : costs.shape[2]] = costs
    keep = _fewest_keys(stacked[1:], np.repeat(counts, tracks) - 1)
    return [part[:, :count] for part, count in zip(np.split(keep, ends[:-1]), counts, strict=True)]


def _keys_of_parts(errors: SegmentErrors, tracks: Ints, budgets: Floats) -> Bools:
    """The keys (k, K) of long tracks, searched in parts of KEYS_PER_PART keys, between which a key stays."""
    keep = np.ones((len(tracks), len(errors)), np.bool_)
    parts = max(MAX_JOINT_TABLE_VALUES // (len(tracks) * errors.span * KEYS_PER_PART), 1)
    for start in range(1, len(errors), parts * KEYS_PER_PART):
        some = slice(start, start + parts * KEYS_PER_PART)
        keep[:, some] = _keys_after_first(errors.costs(tracks, budgets, some))
    return keep


def _keys_after_first(costs: NDArray[np.float32]) -> Bools:
    """Keys (k, n) after a first one, on paths through those between two parts; all parts are searched at once.

    costs: (n, k, span) of the segments that end at each key; inf where none does.
    """
    count, tracks, span = costs.shape
    length = min(count, KEYS_PER_PART)
    parts = -(-count // length)
    last = np.append(np.full(parts - 1, length), count - (parts - 1) * length)
    missing = np.full((parts * length - count, tracks, span), np.inf, np.float32)
    rows = np.concatenate((costs, missing)) if len(missing) else costs
    rows = rows.reshape(parts, length, tracks, span).transpose(1, 2, 0, 3).reshape(length, tracks * parts, span)
    keep = _fewest_keys(rows, np.tile(last, tracks))
    return keep[:, 1:].reshape(tracks, parts * length)[:, :count]


def _fewest_keys(costs: NDArray[np.float32], last: Ints) -> Bools:
    """Mask (R, n + 1) of the first key and those on the paths of least cost from it to the keys `last` (R,).

    costs: (n, R, span) of the segments that end at each key after the first; inf where none does.
    """
    count, rows, span = costs.shape
    total = np.full((rows, count + 1), np.inf, np.float32)
    total[:, 0] = 0
    came = np.zeros((rows, count + 1), np.int64)
    every = np.arange(rows)
    for end in range(1, count + 1):
        width = min(span, end)
        totals = total[:, end - width : end][:, ::-1] + costs[end - 1, :, :width]
        best = totals.argmin(axis=1)
        total[:, end] = totals[every, best]
        came[:, end] = end - 1 - best
    return _trace(came, last)


def _trace(came: Ints, last: Ints) -> Bools:
    """Mask (R, K) of the keys on the optimal paths, traced back in `came` (R, K) from the keys `last` (R,)."""
    keep = np.zeros(came.shape, np.bool_)
    keep[:, 0] = True
    for row, at, kept in zip(came, last.tolist(), keep, strict=True):
        before = row.tolist()
        path = []
        while at:
            path.append(at)
            at = before[at]
        kept[path] = True
    return keep
