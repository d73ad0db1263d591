"""Ways to choose time axes: every track gets one, with the keys that it needs."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Bools, Floats, Ints
from anim.model import Clip
from anim.optimization.options import EFFORTS
from anim.optimization.search import fewest_keys, segment_errors, time_axes
from anim.optimization.search.axis_merging import SharedAxis
from anim.optimization.search.time_axes import LAYOUTS, Asked, TimeAxisSearch, find_axes, find_keys
from tests.anim.optimization.making import (
    CORE,
    TIMES,
    every_point,
    nodding,
    scene,
    stepping,
    truth_of,
    turning,
    waving,
)
from tests.calls import count_calls
from tests.clips import clip, track


def _layouts(what: Clip | None = None) -> TimeAxisSearch:
    of = scene()
    return TimeAxisSearch(truth_of(of, what or waving(), every_point(of)), CORE, 1e-3)


def _axes(layouts: TimeAxisSearch, name: str, keyed: Ints, budgets: Floats) -> list[SharedAxis]:
    (axes,) = find_axes(name, [Asked(layouts, keyed, budgets)])
    return axes


def _keys(layouts: TimeAxisSearch, keyed: Ints, budgets: Floats) -> Bools:
    find_keys([Asked(layouts, keyed, budgets)])
    return layouts.known_keys(keyed, budgets)


SEARCHES = ((fewest_keys, "_stacked_keys"), (time_axes, "greedy_keys"))
KEYED = np.array([0, 1, 2])
BUDGETS = np.array([0.02, 0.01, 0.03, 1.0, 1.0])


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_keyed_track_is_on_one_axis_with_both_ends(name: str) -> None:
    axes = _axes(_layouts(), name, KEYED, BUDGETS)
    assert sorted(i for axis in axes for i in axis.members) == KEYED.tolist()
    assert all(axis.keys[[0, -1]].all() for axis in axes)
    assert _axes(_layouts(), name, KEYED[:0], BUDGETS) == []


@pytest.mark.parametrize("name", ["merged", "groups", "wide groups", "joint", "full"])
def test_lines_between_an_axis_keys_keep_every_budget(name: str) -> None:
    layouts = _layouts()
    of = scene()
    moving = truth_of(of, waving(), every_point(of)).moving
    for axis in _axes(layouts, name, KEYED, BUDGETS):
        for i in axis.members:
            values = moving[i].values[::2]  # the grid, without the middles
            lines = [np.interp(layouts.grid, layouts.grid[axis.keys], column[axis.keys]) for column in values.T]
            off = np.linalg.norm(np.transpose(lines) - values, axis=1).max()
            assert off * moving[i].meters <= BUDGETS[i] * (1 + 1e-9)


def test_given_groups_stay_but_for_tracks_without_keys() -> None:
    """A track that is in no group has an axis of its own."""
    budgets = np.full(5, 0.02)
    asked = Asked(_layouts(), KEYED, budgets, ((2, 0, 4), (3,)))
    (axes,) = find_axes("groups", [asked])
    assert [axis.members for axis in axes] == [(2, 0), (1,)]
    assert axes[0].num_keys >= _axes(asked.layouts, "groups", KEYED[:1], budgets)[0].num_keys


def test_an_axis_of_a_group_has_no_more_keys_than_its_tracks_together() -> None:
    layouts = _layouts()
    (axes,) = find_axes("groups", [Asked(layouts, KEYED, BUDGETS, (tuple(KEYED.tolist()),))])
    each = _keys(layouts, KEYED, BUDGETS)
    assert each.sum(axis=1).max() <= axes[0].num_keys <= np.count_nonzero(each.any(axis=0))


def test_regular_axes() -> None:
    layouts = _layouts()
    for name, nth in (("full", 1), ("second", 2), ("third", 3)):
        (axis,) = _axes(layouts, name, KEYED, BUDGETS)
        assert np.flatnonzero(axis.keys).tolist() == sorted({*range(0, 25, nth), 24})


def test_larger_budgets_need_fewer_keys_and_what_was_found_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    layouts = _layouts()
    counts = [int(_keys(layouts, KEYED, factor * BUDGETS).sum()) for factor in (0.1, 1, 10)]
    assert counts[0] > counts[1] > counts[2] >= 6
    searched = [count_calls(monkeypatch, owner, name) for owner, name in SEARCHES]
    assert [int(_keys(layouts, KEYED, factor * BUDGETS).sum()) for factor in (0.1, 1, 10)] == counts
    assert not any(searched)


def test_efforts_name_layouts() -> None:
    assert {name for effort in EFFORTS.values() for name in (*effort.axes, *effort.groups)} <= set(LAYOUTS)


def test_own_keys_are_those_of_the_source() -> None:
    """Joint 1 has keys at every third time of the grid only: none between them."""
    of, thirds = scene(), TIMES[::3]
    bent = track("rotation", thirds, turning(1.5, times=thirds), node=1)
    source = truth_of(of, clip(bent, *waving().tracks[2:3]), every_point(of))
    layouts = TimeAxisSearch(source, CORE, 1e-3)
    tight = np.full(2, 1e-9)
    by_track = {i: axis.keys for axis in _axes(layouts, "own", np.arange(2), tight) for i in axis.members}
    assert source.grid[by_track[0]] == pytest.approx(thirds)
    assert source.grid[by_track[1]] == pytest.approx(TIMES)
    whole = {i: axis.keys for axis in _axes(layouts, "merged", np.arange(2), tight) for i in axis.members}
    assert whole[0].all()


@pytest.mark.parametrize("tabled", [0, segment_errors.MAX_TABLE_VALUES])
@pytest.mark.parametrize("name", LAYOUTS)
def test_axes_of_clips_together_are_those_of_each_alone(
    name: str, tabled: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also without tables of segments, and of a clip without keyed tracks between the others."""
    monkeypatch.setattr(segment_errors, "MAX_TABLE_VALUES", tabled)
    budgets = np.array([0.02, 0.03, 0.01, 1.0, 1.0])
    keyed = (KEYED, KEYED[:0], KEYED[1:], KEYED)
    clips = (waving(), waving(), nodding(), stepping())

    def asked() -> list[Asked]:
        return [
            Asked(_layouts(what), some, budgets[: len(what.tracks)]) for what, some in zip(clips, keyed, strict=True)
        ]

    together = find_axes(name, asked())
    assert [sorted(i for axis in axes for i in axis.members) for axes in together] == [some.tolist() for some in keyed]
    for axes, alone in zip(together, asked(), strict=True):
        for a, b in zip(axes, _axes(alone.layouts, name, alone.keyed, alone.budgets), strict=True):
            assert a.members == b.members
            np.testing.assert_array_equal(a.keys, b.keys)
