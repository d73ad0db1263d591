"""The search for the cheapest way: what it gives keeps the bound, and more effort never costs more."""

from __future__ import annotations

from dataclasses import replace

import pytest

from anim.optimization.options import EFFORTS, Effort
from anim.optimization.search.lockstep import run_searches
from anim.optimization.search.plan import TrackAction, TrialResult
from anim.optimization.search.search import search
from tests.anim.optimization.making import waving
from tests.anim.optimization.search.stacks import bench


def _found(bound: float, effort: str) -> TrialResult | None:
    return _searched(bound, EFFORTS[effort])


def _searched(bound: float, effort: Effort) -> TrialResult | None:
    made = bench(waving(), bound=bound)
    steps = search(made.sources[0], bound, effort, lambda: made.batch.leeway(0))
    (found,) = run_searches(made.batch, [steps])
    return found


def test_more_effort_and_more_room_take_fewer_bytes() -> None:
    sizes = {}
    for bound in (1e-3, 1e-1, 3e-1):
        for name in ("fast", "balanced"):
            found = _found(bound, name)
            assert found is not None
            assert found.worst <= 1
            sizes[bound, name] = found.size
        assert sizes[bound, "balanced"] <= sizes[bound, "fast"]
    assert sizes[3e-1, "fast"] < sizes[1e-1, "fast"] < sizes[1e-3, "fast"]


def test_the_bound_is_used_and_groups_on_an_axis_each_take_fewer_bytes() -> None:
    found = _searched(0.1, replace(EFFORTS["balanced"], groups=()))
    assert found is not None
    assert found.worst > 0.9
    grouped = _found(0.1, "balanced")
    assert grouped is not None
    assert grouped.size < found.size
    assert grouped.plan.groups == grouped.groups  # which later trials keep


@pytest.mark.parametrize("effort", ["fast", "balanced"])
def test_the_same_every_time(effort: str) -> None:
    first, again = (_found(5e-3, effort) for _ in range(2))
    assert first is not None
    assert again is not None
    assert first.size == again.size
    assert all((first.keys[i].values == again.keys[i].values).all() for i in first.keys)


def test_everything_goes_under_a_bound_that_allows_it() -> None:
    found = _found(100.0, "fast")
    assert found is not None
    assert (found.actions == TrackAction.DROPPED).all()


def test_none_where_float32_itself_is_too_coarse() -> None:
    assert _found(1e-13, "fast") is None
