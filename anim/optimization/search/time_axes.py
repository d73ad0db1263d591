"""Time axes of the keyed tracks of a clip: merged by bytes, one shared axis, or even keys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.curves.fitting.key_reduction import greedy_keys, joint_greedy_keys
from anim.optimization.search import segment_errors
from anim.optimization.search.axis_merging import SharedAxis, merge_axes
from anim.optimization.search.segment_errors import SegmentErrors, Tabulated, fits
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.tracks.quantization import Encoding

CONSTANT_TOLERANCE = 0.1  # of the bound: tracks this close to their middle value get no table
MAX_TABLED_BUDGET = 4.0  # of the bound; larger budgets are rare


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
        self.tabulated = Tabulated(self._scaled[self._tabled], source.grid, MAX_TABLED_BUDGET * bound)
        self.segments: SegmentErrors | None = None
        self._rows: dict[tuple[int, float], Bools] = {}

    def scaled(self, keyed: Ints, budgets: Floats) -> Floats:
        """Return the values of tracks on the grid (k, K, 4) in units of their budgets."""
        return np.asarray(self._scaled[keyed] / budgets[keyed][:, None, None])

    def known_keys(self, keyed: Ints, budgets: Floats) -> Bools:
        """Return the keys (k, K) that each track requires by itself, found by `find_keys`."""
        return np.array([self._rows[i, float(budgets[i])] for i in keyed.tolist()])

    def new_tracks(self, keyed: Ints, budgets: Floats) -> Ints:
        """Return the tracks whose keys under their budgets are not known yet."""
        return np.array([i for i in keyed.tolist() if (i, float(budgets[i])) not in self._rows], np.int64)

    def is_tabled(self, tracks: Ints) -> bool:
        """Return whether any of some tracks are in the table."""
        return bool(self._is_tabled[tracks].any())

    def from_table(self, tracks: Ints, budgets: Floats) -> tuple[Ints, tuple[SegmentErrors, Ints, Floats]]:
        """Return those of some tracks that are in the table, with what `segment_errors.greedy_keys` takes for them."""
        there = tracks[self._is_tabled[tracks]]
        assert self.segments is not None
        return there, (self.segments, np.searchsorted(self._tabled, there), budgets[there])

    def search_others(self, tracks: Ints, budgets: Floats) -> None:
        """Find the keys of those of some tracks that are in no table."""
        others = tracks[~self._is_tabled[tracks]]
        if len(others):
            self.add(others, budgets, greedy_keys(self.scaled(others, budgets), self.grid))

    def add(self, tracks: Ints, budgets: Floats, keys: Bools) -> None:
        """Cache the keys (k, K) of tracks under their budgets."""
        self._rows.update(((i, float(budgets[i])), row) for i, row in zip(tracks.tolist(), keys, strict=True))


def find_axes(name: str, asked: Sequence[Asked]) -> list[list[SharedAxis]]:
    """Return the time axes of tracks of several clips, each of its own, by the layout `name`."""
    some = [each for each in asked if len(each[1])]
    found = iter(LAYOUTS[name](some) if some else [])
    return [next(found) if len(keyed) else [] for _, keyed, _ in asked]


def find_keys(asked: Sequence[Asked]) -> None:
    """Find the keys that tracks of several clips require by themselves, those that are not known yet."""
    new = [layouts.new_tracks(keyed, budgets) for layouts, keyed, budgets in asked]
    _tabulate([layouts for (layouts, *_), some in zip(asked, new, strict=True) if layouts.is_tabled(some)])
    searches = []
    for (layouts, _, budgets), some in zip(asked, new, strict=True):
        layouts.search_others(some, budgets)
        if layouts.is_tabled(some):
            searches.append((layouts, budgets, *layouts.from_table(some, budgets)))
    found = segment_errors.greedy_keys([table for *_, table in searches])
    for (layouts, budgets, there, _), keys in zip(searches, found, strict=True):
        layouts.add(there, budgets, keys)


def _tabulate(every: Sequence[TimeAxisSearch]) -> None:
    """Make the tables of clips that have none yet."""
    missing = [each for each in every if each.segments is None]
    for each, table in zip(missing, segment_errors.tabulate([each.tabulated for each in missing]), strict=True):
        each.segments = table


def _merge_by_bytes(asked: Sequence[Asked]) -> list[list[SharedAxis]]:
    find_keys(asked)
    return _merge([(layouts, keyed, layouts.known_keys(keyed, budgets)) for layouts, keyed, budgets in asked])


def _merge(asked: Sequence[tuple[TimeAxisSearch, Ints, Bools]]) -> list[list[SharedAxis]]:
    """The axes of fewest bytes for the tracks `keyed` (k,) of each clip, which require the keys `keep` (k, K)."""
    coding = asked[0][0].coding
    merged = merge_axes(
        [(keep, layouts.key_bytes[keyed]) for layouts, keyed, keep in asked],
        axis_bytes=coding.byte_costs.axis,
        time_bytes=coding.time_bytes,
    )
    return [
        [SharedAxis(axis.keys, tuple(keyed[list(axis.members)].tolist())) for axis in axes]
        for axes, (_, keyed, _) in zip(merged, asked, strict=True)
    ]


def _source_key_axes(asked: Sequence[Asked]) -> list[list[SharedAxis]]:
    """Axes of source keys only: players with component-wise interpolation then deviate like the source."""
    return [_of_source_keys(*each) for each in asked]


def _of_source_keys(layouts: TimeAxisSearch, keyed: Ints, budgets: Floats) -> list[SharedAxis]:
    kinds, kind = np.unique(layouts.own[keyed], axis=0, return_inverse=True)
    axes = []
    for number, mask in enumerate(kinds):
        members = keyed[kind.reshape(-1) == number]
        keep = np.zeros((len(members), len(mask)), np.bool_)
        keep[:, mask] = greedy_keys(layouts.scaled(members, budgets)[:, mask], layouts.grid[mask])
        axes += _merge([(layouts, members, keep)])[0]
    return axes


def _one_axis(asked: Sequence[Asked]) -> list[list[SharedAxis]]:
    return [
        [SharedAxis(joint_greedy_keys(layouts.scaled(keyed, budgets), layouts.grid), tuple(keyed.tolist()))]
        for layouts, keyed, budgets in asked
    ]


def _even_axis(nth: int) -> Layout:
    def layout(asked: Sequence[Asked]) -> list[list[SharedAxis]]:
        axes = []
        for layouts, keyed, _ in asked:
            keys = np.zeros(len(layouts.grid), np.bool_)
            keys[::nth] = keys[-1] = True
            axes.append([SharedAxis(keys, tuple(keyed.tolist()))])
        return axes

    return layout


Asked: TypeAlias = tuple[TimeAxisSearch, Ints, Floats]  # tracks `keyed` (k,) of a clip, and the budgets (G,) in metres
Layout: TypeAlias = Callable[[Sequence[Asked]], list[list[SharedAxis]]]

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
