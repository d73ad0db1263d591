"""One trial: what it says of error and bytes, against the ruler of `anim.measure` and plain sums."""

from __future__ import annotations

import math

import numpy as np
import pytest

from anim.maths import quaternion
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip
from anim.optimization.options import Bounds
from anim.optimization.search import time_axes
from anim.optimization.search.bound_usage import BoundUsage
from anim.optimization.search.keyed_tracks import KeyedTracks
from anim.optimization.search.plan import RotationTarget, TrackAction, TrialResult
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.search.time_axes import LAYOUTS
from anim.sampling import sample_pose
from tests.anim.optimization.making import CORE, turning, waving
from tests.anim.optimization.search.stacks import BOUND, OF, bench
from tests.calls import count_calls
from tests.clips import clip, track


def _clip(what: Clip, source: SourceMotion, outcome: TrialResult) -> Clip:
    """What the outcome says would be written."""
    tracks = []
    for k, moving in enumerate(source.moving):
        if outcome.actions[k] == TrackAction.DROPPED:
            continue
        at = source.grid[outcome.on[k]] if k in outcome.on else [0.0]
        tracks.append(track(moving.path, at, outcome.keys[k].values, node=moving.node))
    return clip(*tracks, name=what.name)


@pytest.mark.parametrize("axes", LAYOUTS)
def test_the_error_is_the_rulers(axes: str) -> None:
    what = waving()
    runner = bench(what)
    outcome = runner.run(runner.plan(axes=axes))
    ruler = ErrorMetric(OF)
    arcs, chords = (
        ruler.error_at(what, _clip(what, runner.sources[0], outcome), runner.sources[0].at, player=player).max_error
        for player in ("raw", "nlerp")
    )
    expected = arcs if outcome.worst > 1 else max(arcs, chords)
    assert BOUND * outcome.worst == pytest.approx(expected, rel=0.02)
    assert BOUND * outcome.worst >= arcs * 0.998


def test_the_size_is_keys_and_json() -> None:
    runner = bench(waving(), droppable=False)
    outcome = runner.run(runner.plan())
    assert outcome.actions.tolist() == [
        TrackAction.KEYED,
        TrackAction.KEYED,
        TrackAction.KEYED,
        TrackAction.CONSTANT,
        TrackAction.CONSTANT,
    ]
    axes = {on.tobytes(): int(on.sum()) for on in outcome.on.values()}
    data = sum(4 * count for count in axes.values())
    for i in range(3):
        keys = outcome.keys[i]
        data += keys.values.size * {"int16": 2, "float32": 4}[keys.form]
    text = 3 * CORE.byte_costs.track + 2 * CORE.byte_costs.single_key + len(axes) * CORE.byte_costs.axis
    assert outcome.size == data + text


def test_what_rests_is_dropped_only_where_it_may_be() -> None:
    kept, dropped = (runner.run(runner.plan()) for runner in (bench(waving(), droppable=False), bench(waving())))
    assert (kept.actions[3], dropped.actions[3]) == (TrackAction.CONSTANT, TrackAction.DROPPED)
    assert (kept.actions[4], dropped.actions[4]) == (TrackAction.CONSTANT, TrackAction.CONSTANT)
    assert kept.keys[3].values.tolist() == [[1, 1, 1]]
    assert kept.keys[4].values.tolist() == [[0.75, 0.75, 0.75]]
    assert 3 not in dropped.keys


def test_held_as_other_clips_hold_it() -> None:
    runner = bench(
        clip(track("scale", [0, 1], [[1.2, 1.2, 1.2], [1.2001, 1.2, 1.2]], node=4)), shared=np.full(3, 1.2002)
    )
    outcome = runner.run(runner.plan())
    assert outcome.actions.tolist() == [TrackAction.CONSTANT]
    assert outcome.keys[0].values[0] == pytest.approx([1.2002] * 3, rel=1e-6)


def test_chords_are_asked_where_they_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    """150° in a step or two would do along arcs; players that mix components cut the corner."""
    monkeypatch.setattr(time_axes, "MAX_TABLED_BUDGET", math.inf)
    times = np.linspace(0, 2, 49)
    angles = np.radians(150) * times / 2
    values = np.stack((0 * angles, 0 * angles, np.sin(angles / 2), np.cos(angles / 2)), axis=1)
    runner = bench(clip(track("rotation", times, values, node=1)))
    plan = runner.plan(budget=2.0)
    cheap, thorough = runner.run(plan, smaller_than=0.0), runner.run(plan)
    assert cheap.worst < 0.2
    assert thorough.worst > 1
    assert cheap.size == thorough.size
    assert int(thorough.on[0].sum()) <= 3


def test_a_bound_on_angles() -> None:
    what = clip(track("rotation", np.linspace(0, 2, 25), turning(1.0), node=1))
    runner = bench(what, bounds=Bounds(BOUND, 0.0, max_angle=math.radians(0.2)))
    outcome = runner.run(runner.plan(budget=0.2))
    written = _clip(what, runner.sources[0], outcome)
    a, b = (sample_pose(OF.skeleton, each, runner.sources[0].at).rotation for each in (what, written))
    turned = np.degrees(quaternion.angle_between(a, b)[:, 1].max())
    assert float(outcome.own[0]) * 0.2 == pytest.approx(turned, rel=0.01)


def test_a_bound_on_speed() -> None:
    what = waving()
    plain = bench(what)
    strict = bench(what, bounds=Bounds(BOUND, 0.0, max_speed_error=0.01))
    slow, fast = plain.run(plain.plan()), strict.run(strict.plan())
    assert slow.worst <= 1
    assert fast.worst > slow.worst
    finer = strict.run(strict.plan(budget=BOUND / 300))
    assert finer.worst < fast.worst


def test_tracks_stored_alike_count_once() -> None:
    """Joints 1 and 2 turn alike: the second costs but its channel."""
    times = np.linspace(0, 2, 25)
    both = bench(clip(*(track("rotation", times, turning(1.0), node=node) for node in (1, 2))))
    alone = bench(clip(track("rotation", times, turning(1.0), node=1)))
    pair, one = (runner.run(runner.plan(axes="full")) for runner in (both, alone))
    assert pair.actions.tolist() == [TrackAction.KEYED, TrackAction.KEYED]
    assert pair.size - one.size == CORE.byte_costs.repeated


@pytest.mark.parametrize("apart", [0.0, 1e-6, 0.1])
@pytest.mark.parametrize("budget", [BOUND / 3, BOUND / 3e6])
def test_results_that_are_not_smaller_have_no_keys(
    monkeypatch: pytest.MonkeyPatch, apart: float, budget: float
) -> None:
    """Tracks with equal or nearly equal values count once, in int16 and in float32: the size is known before."""
    times = np.linspace(0, 2, 25)
    tracks = [track("rotation", times, turning(1.0 + apart * node), node=node) for node in (1, 2)]
    runner = bench(clip(*tracks, track("translation", times, np.sin(times[:, None] * [1, 2, 3]), node=1)))
    plan = runner.plan(0, budget)
    full = runner.run(plan)
    asked = count_calls(monkeypatch, KeyedTracks, "each")
    assert runner.attempt(plan, limit=full.size) is None
    assert bool(asked) == (apart == 1e-6 and budget < 1e-6)  # two in float32, which may have become one
    assert runner.attempt(plan, limit=full.size + 1) is not None


def test_results_that_are_not_smaller_are_not_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    runner = bench(waving())
    plan = runner.plan()
    full = runner.run(plan)
    measured = count_calls(monkeypatch, BoundUsage, "_usage")
    assert runner.attempt(plan, limit=full.size) is None
    assert not measured
    assert runner.attempt(plan, limit=full.size + 1) is not None
    assert measured


@pytest.mark.parametrize("target", RotationTarget)
def test_equal_decisions_are_measured_once(monkeypatch: pytest.MonkeyPatch, target: RotationTarget) -> None:
    runner = bench(waving())
    plans = [runner.plan(0, each * BOUND, rotation_target=target) for each in (1, 1.1, 2)]
    fresh = [bench(waving()).run(plan, smaller_than=0) for plan in plans]
    counted = count_calls(monkeypatch, BoundUsage, "slerp_raw")
    found = [runner.run(plan, smaller_than=0) for plan in plans]
    assert len(counted) == 2
    for one, other in zip(found, fresh, strict=True):
        assert (one.size, one.plan is other.plan) == (other.size, True)
        np.testing.assert_array_equal(one.usage, other.usage)
        assert {i: each.name for i, each in one.keys.items()} == {i: each.name for i, each in other.keys.items()}
    assert runner.attempt(plans[1], limit=found[1].size) is None
