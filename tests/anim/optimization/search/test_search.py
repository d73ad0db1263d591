"""The search for the cheapest way: what it gives keeps the bound, and more effort never costs more."""

from __future__ import annotations

import numpy as np
import pytest

from anim.optimization.options import EFFORTS, Bounds
from anim.optimization.search.plan import TrackAction
from anim.optimization.search.search import search
from anim.optimization.search.trial import BoundUsage, TrialRunner
from tests.anim.optimization.making import CORE, every_point, scene, truth_of, waving

OF = scene()


def _bench(bound: float) -> TrialRunner:
    points = every_point(OF)
    source = truth_of(OF, waving(), points)
    count = len(source.moving)
    allowed = np.full(len(points), bound)
    usage = BoundUsage(OF.skeleton, source, allowed, Bounds(bound, 0.0))
    return TrialRunner(OF.skeleton, source, usage, CORE, np.ones(count, bool), [()] * count)


def test_more_effort_and_more_room_take_fewer_bytes() -> None:
    sizes = {}
    for bound in (1e-3, 3e-2, 3e-1):
        for name in ("fast", "balanced"):
            found = search(_bench(bound), bound, EFFORTS[name])
            assert found is not None
            assert found.worst <= 1
            sizes[bound, name] = found.size
        assert sizes[bound, "balanced"] <= sizes[bound, "fast"]
    assert sizes[3e-1, "fast"] < sizes[3e-2, "fast"] < sizes[1e-3, "fast"]


def test_the_bound_is_used() -> None:
    found = search(_bench(0.1), 0.1, EFFORTS["balanced"])
    assert found is not None
    assert found.worst > 0.9


@pytest.mark.parametrize("effort", ["fast", "balanced"])
def test_the_same_every_time(effort: str) -> None:
    first, again = (search(_bench(5e-3), 5e-3, EFFORTS[effort]) for _ in range(2))
    assert first is not None
    assert again is not None
    assert first.size == again.size
    assert all((first.keys[i].values == again.keys[i].values).all() for i in first.keys)


def test_everything_goes_under_a_bound_that_allows_it() -> None:
    found = search(_bench(100.0), 100.0, EFFORTS["fast"])
    assert found is not None
    assert (found.actions == TrackAction.DROPPED).all()


def test_none_where_float32_itself_is_too_coarse() -> None:
    assert search(_bench(1e-13), 1e-13, EFFORTS["fast"]) is None
