"""Time axes of the keyed tracks of a clip: merged by bytes, one shared axis, or even keys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.curves.fitting.key_reduction import KEYS_PER_PART, greedy_keys, joint_greedy_keys
from anim.optimization.search import fewest_keys, segment_errors
from anim.optimization.search.axis_groups import Reaches, group_tracks
from anim.optimization.search.axis_merging import SharedAxis, merge_axes
from anim.optimization.search.plan import Groups
from anim.optimization.search.segment_errors import SegmentErrors, Tabulated, fits
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.tracks.quantization import Encoding

CONSTANT_TOLERANCE = 0.1  # of the bound: tracks this close to their middle value get no table
MAX_TABLED_BUDGET = 4.0  # of the bound; larger budgets are rare
MAX_GROUPED_VALUES = 4_000_000  # tracks² × keys whose pairs are compared for groups: 32 MB, and seconds


class Asked(NamedTuple):
    """The tracks `keyed` (k,) of a clip that need axes, with the budgets (G,), m, of all its tracks.

    groups: of tracks that share an axis in the layout of groups; empty to find them.
    """

    layouts: TimeAxisSearch
    keyed: Ints
    budgets: Floats
    groups: Groups = ()


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
        self._is_groupable = len(self._tabled) ** 2 * len(source.grid) <= MAX_GROUPED_VALUES
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
        """Return those of some tracks that are in the table, with what `fewest_keys.greedy_keys` takes for them."""
        there = tracks[self._is_tabled[tracks]]
        return there, (self._table, np.searchsorted(self._tabled, there), budgets[there])

    def has_table(self, tracks: Ints) -> bool:
        """Return whether there is a table for all of some tracks, which is searched at once."""
        return len(self.grid) <= KEYS_PER_PART and bool(self._is_tabled[tracks].all())

    def can_group(self, tracks: Ints) -> bool:
        """Return whether groups of some tracks can be found: there is a table for all, and they are not too many."""
        return self._is_groupable and self.has_table(tracks)

    def reaches(self, keyed: Ints, budgets: Floats) -> Reaches:
        """Return what `group_tracks` takes for tracks, all of them in the table."""
        return self._table.reach(np.searchsorted(self._tabled, keyed), budgets[keyed]), self.key_bytes[keyed]

    def table_of_groups(self, groups: Sequence[Ints], budgets: Floats) -> tuple[SegmentErrors, list[Ints], Floats]:
        """Return what `fewest_keys.shared_keys` takes for groups of tracks."""
        rows = [np.searchsorted(self._tabled, each) for each in groups]
        return self._table, rows, budgets[np.concatenate(groups)]

    @property
    def _table(self) -> SegmentErrors:
        assert self.segments is not None, "`_tabulate` makes the tables of all clips together"
        return self.segments

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
    some = [each for each in asked if len(each.keyed)]
    found = iter(LAYOUTS[name](some) if some else [])
    return [next(found) if len(each.keyed) else [] for each in asked]


def find_keys(asked: Sequence[Asked]) -> None:
    """Find the keys that tracks of several clips require by themselves, those that are not known yet."""
    new = [layouts.new_tracks(keyed, budgets) for layouts, keyed, budgets, _ in asked]
    _tabulate([layouts for (layouts, *_), some in zip(asked, new, strict=True) if layouts.is_tabled(some)])
    searches = []
    for (layouts, _, budgets, _), some in zip(asked, new, strict=True):
        layouts.search_others(some, budgets)
        if layouts.is_tabled(some):
            searches.append((layouts, budgets, *layouts.from_table(some, budgets)))
    found = fewest_keys.greedy_keys([table for *_, table in searches])
    for (layouts, budgets, there, _), keys in zip(searches, found, strict=True):
        layouts.add(there, budgets, keys)


def _tabulate(every: Sequence[TimeAxisSearch]) -> None:
    """Make the tables of clips that have none yet."""
    missing = [each for each in every if each.segments is None]
    for each, table in zip(missing, segment_errors.tabulate([each.tabulated for each in missing]), strict=True):
        each.segments = table


def _merge_by_bytes(asked: Sequence[Asked]) -> list[list[SharedAxis]]:
    find_keys(asked)
    return _merge([(layouts, keyed, layouts.known_keys(keyed, budgets)) for layouts, keyed, budgets, _ in asked])


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


def _group_axes(asked: Sequence[Asked], key_bytes_factor: float = 1.0) -> list[list[SharedAxis]]:
    """Axes with the fewest keys for all tracks of a group; merged ones for clips whose groups can't be found.

    key_bytes_factor: on the bytes of keys in the choice of groups.
    """
    found: list[list[SharedAxis]] = [[] for _ in asked]
    untabled = [n for n, each in enumerate(asked) if each.groups and not each.layouts.has_table(each.keyed)]
    for n in untabled:
        found[n] = _untabled_axes(asked[n])
    others = [n for n, each in enumerate(asked) if not each.groups and not each.layouts.can_group(each.keyed)]
    for n, axes in zip(others, _merge_by_bytes([asked[n] for n in others]) if others else [], strict=True):
        found[n] = axes
    tabled = [n for n, each in enumerate(asked) if n not in others and n not in untabled]
    _tabulate([asked[n].layouts for n in tabled])
    groups = _groups([asked[n] for n in tabled], key_bytes_factor)
    tables = [asked[n].layouts.table_of_groups(some, asked[n].budgets) for n, some in zip(tabled, groups, strict=True)]
    for n, some, keys in zip(tabled, groups, fewest_keys.shared_keys(tables), strict=True):
        found[n] = [SharedAxis(mask, tuple(each.tolist())) for mask, each in zip(keys, some, strict=True)]
    return found


def _groups(asked: Sequence[Asked], key_bytes_factor: float) -> list[list[Ints]]:
    """The groups of each clip: those that were asked for, or else the best ones found."""
    new = [each for each in asked if not each.groups]
    found = iter(_find_groups(new, key_bytes_factor) if new else [])
    return [_groups_asked_for(each) if each.groups else next(found) for each in asked]


def _find_groups(asked: Sequence[Asked], key_bytes_factor: float) -> list[list[Ints]]:
    coding = asked[0].layouts.coding
    reaches = [layouts.reaches(keyed, budgets) for layouts, keyed, budgets, _ in asked]
    groups = group_tracks(
        [(reach, key_bytes_factor * key_bytes) for reach, key_bytes in reaches],
        axis_bytes=coding.byte_costs.axis,
        time_bytes=coding.time_bytes,
    )
    return [[np.sort(each.keyed[group]) for group in some] for each, some in zip(asked, groups, strict=True)]


def _untabled_axes(asked: Asked) -> list[SharedAxis]:
    """The axes of groups of which some tracks are in no table."""
    layouts, groups = asked.layouts, _groups_asked_for(asked)
    return [
        SharedAxis(joint_greedy_keys(layouts.scaled(each, asked.budgets), layouts.grid), tuple(each.tolist()))
        for each in groups
    ]


def _groups_asked_for(asked: Asked) -> list[Ints]:
    """The groups that were asked for, of keyed tracks, and a group for each further track."""
    keyed = set(asked.keyed.tolist())
    groups = [np.array([i for i in each if i in keyed], np.int64) for each in asked.groups]
    further = keyed.difference(*asked.groups)
    return [each for each in groups if len(each)] + [np.array([i]) for i in sorted(further)]


def _source_key_axes(asked: Sequence[Asked]) -> list[list[SharedAxis]]:
    """Axes of source keys only: players with component-wise interpolation then deviate like the source."""
    return [_of_source_keys(layouts, keyed, budgets) for layouts, keyed, budgets, _ in asked]


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
        for layouts, keyed, budgets, _ in asked
    ]


def _even_axis(nth: int) -> Layout:
    def layout(asked: Sequence[Asked]) -> list[list[SharedAxis]]:
        axes = []
        for layouts, keyed, *_ in asked:
            keys = np.zeros(len(layouts.grid), np.bool_)
            keys[::nth] = keys[-1] = True
            axes.append([SharedAxis(keys, tuple(keyed.tolist()))])
        return axes

    return layout


Layout: TypeAlias = Callable[[Sequence[Asked]], list[list[SharedAxis]]]

# Keys that cost half in the choice of groups give fewer axes: which is smaller shows after feedback.
GROUPING_LAYOUTS: dict[str, Layout] = {
    "groups": _group_axes,
    "wide groups": partial(_group_axes, key_bytes_factor=0.5),
}
LAYOUTS: dict[str, Layout] = {
    "merged": _merge_by_bytes,
    **GROUPING_LAYOUTS,
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
