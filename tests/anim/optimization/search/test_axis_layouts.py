"""Ways to choose time axes: every track gets one, with the keys that it needs."""

from __future__ import annotations

import numpy as np
import pytest

from anim.optimization.options import EFFORTS
from anim.optimization.search.time_axes import LAYOUTS, TimeAxisSearch
from tests.anim.optimization.making import CORE, TIMES, every_point, scene, truth_of, turning, waving
from tests.clips import clip, track


def _layouts() -> TimeAxisSearch:
    of = scene()
    return TimeAxisSearch(truth_of(of, waving(), every_point(of)), CORE, 1e-3)


KEYED = np.array([0, 1, 2])
BUDGETS = np.array([0.02, 0.01, 0.03, 1.0, 1.0])


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_keyed_track_is_on_one_axis_with_both_ends(name: str) -> None:
    axes = _layouts().axes(name, KEYED, BUDGETS)
    assert sorted(i for axis in axes for i in axis.members) == KEYED.tolist()
    assert all(axis.keys[[0, -1]].all() for axis in axes)
    assert _layouts().axes(name, KEYED[:0], BUDGETS) == []


@pytest.mark.parametrize("name", ["merged", "joint", "full"])
def test_lines_between_an_axis_keys_keep_every_budget(name: str) -> None:
    layouts = _layouts()
    of = scene()
    moving = truth_of(of, waving(), every_point(of)).moving
    for axis in layouts.axes(name, KEYED, BUDGETS):
        for i in axis.members:
            values = moving[i].values[::2]  # the grid, without the middles
            lines = [np.interp(layouts.grid, layouts.grid[axis.keys], column[axis.keys]) for column in values.T]
            off = np.linalg.norm(np.transpose(lines) - values, axis=1).max()
            assert off * moving[i].meters <= BUDGETS[i] * (1 + 1e-9)


def test_regular_axes() -> None:
    layouts = _layouts()
    for name, nth in (("full", 1), ("second", 2), ("third", 3)):
        (axis,) = layouts.axes(name, KEYED, BUDGETS)
        assert np.flatnonzero(axis.keys).tolist() == sorted({*range(0, 25, nth), 24})


def test_larger_budgets_need_fewer_keys_and_what_was_found_is_kept() -> None:
    layouts = _layouts()
    counts = [int(layouts.greedy_keys(KEYED, factor * BUDGETS).sum()) for factor in (0.1, 1, 10)]
    assert counts[0] > counts[1] > counts[2] >= 6
    assert [int(layouts.greedy_keys(KEYED, factor * BUDGETS).sum()) for factor in (0.1, 1, 10)] == counts


def test_efforts_name_layouts() -> None:
    assert {name for effort in EFFORTS.values() for name in effort.axes} <= set(LAYOUTS)


def test_own_keys_are_those_of_the_source() -> None:
    """Joint 1 has keys at every third time of the grid only: none between them."""
    of, thirds = scene(), TIMES[::3]
    bent = track("rotation", thirds, turning(1.5, times=thirds), node=1)
    source = truth_of(of, clip(bent, *waving().tracks[2:3]), every_point(of))
    layouts = TimeAxisSearch(source, CORE, 1e-3)
    tight = np.full(2, 1e-9)
    by_track = {i: axis.keys for axis in layouts.axes("own", np.arange(2), tight) for i in axis.members}
    assert source.grid[by_track[0]] == pytest.approx(thirds)
    assert source.grid[by_track[1]] == pytest.approx(TIMES)
    whole = {i: axis.keys for axis in layouts.axes("merged", np.arange(2), tight) for i in axis.members}
    assert whole[0].all()
