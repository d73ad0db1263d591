"""Time axes of the keyed tracks of a clip: merged by bytes, one shared axis, or even keys."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.curves.fitting.key_reduction import greedy_keys, joint_greedy_keys
from anim.optimization.search.segment_errors import SegmentErrors, fits
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.tracks.quantization import Encoding

CONSTANT_TOLERANCE = 0.1  # of the bound: tracks this close to their middle value get no table
MAX_BUDGET_PER_BOUND = 4.0  # larger budgets are rare


@dataclass(frozen=True, slots=True)
class SharedAxis:
    """Mask (K,) of the grid's times that are the keys of all tracks `members`."""

    keys: Bools
    members: tuple[int, ...]


def merge_axes(keep: Bools, key_bytes: Floats, *, axis_bytes: float, time_bytes: float) -> list[SharedAxis]:
    """Return the axes of fewest bytes found for tracks that require the keys `keep` (G, K).

    key_bytes: (G,) of one key of each track. An axis costs `axis_bytes` and `time_bytes` per key. The pair whose
    union saves most is merged until none saves anything.
    """
    groups: dict[bytes, list[int]] = {}
    for i, row in enumerate(keep):
        groups.setdefault(row.tobytes(), []).append(i)
    members = list(groups.values())
    if len(members) == 1:
        return [SharedAxis(keep[0], tuple(members[0]))]
    sets = np.array([keep[m[0]] for m in members], np.float64)
    width = np.array([key_bytes[m].sum() for m in members])
    count = sets.sum(axis=1)
    cost = axis_bytes + count * (time_bytes + width)
    union = count[:, None] + count - sets @ sets.T
    gain = cost[:, None] + cost - axis_bytes - union * (time_bytes + width[:, None] + width)
    np.fill_diagonal(gain, -np.inf)
    alive = np.ones(len(members), np.bool_)
    for _ in range(len(members) - 1):
        a, b = divmod(int(gain.argmax()), len(members))
        if gain[a, b] <= 0:
            break
        sets[a] = np.maximum(sets[a], sets[b])
        members[a] = members[a] + members[b]
        width[a] += width[b]
        count[a] = sets[a].sum()
        cost[a] = axis_bytes + count[a] * (time_bytes + width[a])
        alive[b] = False
        gain[b] = gain[:, b] = -np.inf
        union_a = count[a] + count - sets @ sets[a]
        row = cost[a] + cost - axis_bytes - union_a * (time_bytes + width[a] + width)
        row[~alive] = row[a] = -np.inf
        gain[a] = gain[:, a] = row
    return [SharedAxis(sets[a] > 0, tuple(members[a])) for a in np.flatnonzero(alive).tolist()]


class TimeAxisSearch:
    """Search for the time axes of one clip; results per track and budget are cached.

    bound: m, the error bound of the clip: tracks far below it are rarely keyed.
    """

    def __init__(self, source: SourceMotion, coding: Encoding, bound: float) -> None:
        self.grid = source.grid
        self.own = source.own
        self.coding = coding
        self.key_bytes = np.array([coding.key_bytes(each.path) for each in source.moving])
        self._scaled = _scaled(source)
        moved = np.array([each.from_middle for each in source.moving])
        self._tabled = np.flatnonzero(moved > CONSTANT_TOLERANCE * bound)
        if not fits(len(self._tabled), source.grid):
            self._tabled = np.empty(0, np.int64)
        self._is_tabled = np.zeros(len(moved), np.bool_)
        self._is_tabled[self._tabled] = True
        self._segments = SegmentErrors(self._scaled[self._tabled], source.grid, MAX_BUDGET_PER_BOUND * bound)
        self._rows: dict[tuple[int, float], Bools] = {}

    def axes(self, name: str, keyed: Ints, budgets: Floats) -> list[SharedAxis]:
        """Return the axes of the tracks `keyed` under their budgets (G,) in metres, by the layout `name`."""
        return LAYOUTS[name](self, keyed, budgets) if len(keyed) else []

    def scaled(self, keyed: Ints, budgets: Floats) -> Floats:
        """Return the values of tracks on the grid (k, K, 4) in units of their budgets."""
        return np.asarray(self._scaled[keyed] / budgets[keyed][:, None, None])

    def greedy_keys(self, keyed: Ints, budgets: Floats) -> Bools:
        """Return the keys (k, K) that each track requires by itself."""
        names = [(i, float(budgets[i])) for i in keyed.tolist()]
        new = [k for k, name in enumerate(names) if name not in self._rows]
        if new:
            found = self._search(keyed[new], budgets)
            self._rows.update((names[k], row) for k, row in zip(new, found, strict=True))
        return np.array([self._rows[name] for name in names])

    def _search(self, keyed: Ints, budgets: Floats) -> Bools:
        """The same without the cache: from the table for the tracks in it, else by a new search."""
        rows = np.searchsorted(self._tabled, keyed)
        there = self._is_tabled[keyed]
        found = np.zeros((len(keyed), len(self.grid)), np.bool_)
        if there.any():
            found[there] = self._segments.greedy_keys(rows[there], budgets[keyed[there]])
        if not there.all():
            found[~there] = greedy_keys(self.scaled(keyed[~there], budgets), self.grid)
        return found

    def merge(self, keyed: Ints, keep: Bools) -> list[SharedAxis]:
        """Return the axes of fewest bytes for tracks that require the keys `keep` (k, K)."""
        prices, width = self.coding.byte_costs, self.key_bytes[keyed]
        axes = merge_axes(keep, width, axis_bytes=prices.axis, time_bytes=self.coding.time_bytes)
        return [SharedAxis(axis.keys, tuple(keyed[list(axis.members)].tolist())) for axis in axes]


def _merge_by_bytes(layouts: TimeAxisSearch, keyed: Ints, budgets: Floats) -> list[SharedAxis]:
    return layouts.merge(keyed, layouts.greedy_keys(keyed, budgets))


def _source_key_axes(layouts: TimeAxisSearch, keyed: Ints, budgets: Floats) -> list[SharedAxis]:
    """Axes of source keys only: players with component-wise interpolation then deviate like the source."""
    kinds, kind = np.unique(layouts.own[keyed], axis=0, return_inverse=True)
    axes = []
    for number, mask in enumerate(kinds):
        members = keyed[kind.reshape(-1) == number]
        keep = np.zeros((len(members), len(mask)), np.bool_)
        keep[:, mask] = greedy_keys(layouts.scaled(members, budgets)[:, mask], layouts.grid[mask])
        axes += layouts.merge(members, keep)
    return axes


def _one_axis(layouts: TimeAxisSearch, keyed: Ints, budgets: Floats) -> list[SharedAxis]:
    keys = joint_greedy_keys(layouts.scaled(keyed, budgets), layouts.grid)
    return [SharedAxis(keys, tuple(keyed.tolist()))]


def _even_axis(nth: int) -> Layout:
    def layout(layouts: TimeAxisSearch, keyed: Ints, budgets: Floats) -> list[SharedAxis]:
        keys = np.zeros(len(layouts.grid), np.bool_)
        keys[::nth] = keys[-1] = True
        return [SharedAxis(keys, tuple(keyed.tolist()))]

    return layout


Layout: TypeAlias = Callable[[TimeAxisSearch, Ints, Floats], list[SharedAxis]]

LAYOUTS: dict[str, Layout] = {
    "merged": _merge_by_bytes,
    "own": _source_key_axes,
    "joint": _one_axis,
    "full": _even_axis(1),
    "second": _even_axis(2),
    "third": _even_axis(3),
}


def _scaled(source: SourceMotion) -> Floats:
    """Values on the grid, in metres, padded to four components (G, K, 4)."""
    scaled = np.zeros((len(source.moving), len(source.grid), 4))
    for i, each in enumerate(source.moving):
        scaled[i, :, : each.values.shape[1]] = each.values[source.on_grid] * each.meters
    return scaled
