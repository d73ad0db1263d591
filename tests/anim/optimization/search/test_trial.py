"""One trial: what it says of error and bytes, against the ruler of `anim.measure` and plain sums."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.maths import quaternion
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.point_matrix import PointMatrix
from anim.model import Clip, Scene
from anim.optimization.options import Bounds
from anim.optimization.search import time_axes
from anim.optimization.search.candidates import Candidates
from anim.optimization.search.plan import Plan, RotationTarget, TrackAction, TrialResult
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.search.time_axes import LAYOUTS, SharedAxis
from anim.optimization.search.trial import BoundUsage, TrialRunner
from anim.sampling import sample_pose
from tests.anim.optimization.making import CORE, every_point, scene, truth_of, turning, waving
from tests.calls import count_calls
from tests.clips import clip, track

OF = scene()
POINTS = every_point(OF)
BOUND = 0.02


def _bench(
    what: Clip, *, bounds: Bounds | None = None, droppable: bool = True, shared: Floats | None = None, of: Scene = OF
) -> TrialRunner:
    points: PointMatrix = every_point(of)
    source: SourceMotion = truth_of(of, what, points)
    count = len(source.moving)
    usage = BoundUsage(of.skeleton, source, np.full(len(points), BOUND), bounds or Bounds(BOUND, 0.0))
    values = [() if shared is None else (shared,)] * count
    return TrialRunner(of.skeleton, source, usage, CORE, np.full(count, droppable), values)


def _plan(runner: TrialRunner, budget: float = BOUND / 3, **more: object) -> Plan:
    count = len(runner.source.moving)
    plan = Plan(np.full(count, budget), 0.0, "merged", np.ones(count))
    return replace(plan, **more)  # type: ignore[arg-type]


def _clip(what: Clip, runner: TrialRunner, outcome: TrialResult) -> Clip:
    """What the outcome says would be written."""
    tracks = []
    for k, moving in enumerate(runner.source.moving):
        if outcome.actions[k] == TrackAction.DROPPED:
            continue
        at = runner.source.grid[outcome.on[k]] if k in outcome.on else [0.0]
        tracks.append(track(moving.path, at, outcome.keys[k].values, node=moving.node))
    return clip(*tracks, name=what.name)


@pytest.mark.parametrize("axes", LAYOUTS)
def test_the_error_is_the_rulers(axes: str) -> None:
    what = waving()
    runner = _bench(what)
    outcome = runner.run(_plan(runner, axes=axes))
    ruler = ErrorMetric(OF)
    arcs, chords = (
        ruler.error_at(what, _clip(what, runner, outcome), runner.source.at, player=player).max_error
        for player in ("raw", "nlerp")
    )
    expected = arcs if outcome.worst > 1 else max(arcs, chords)
    assert BOUND * outcome.worst == pytest.approx(expected, rel=0.02)
    assert BOUND * outcome.worst >= arcs * 0.998


def test_the_size_is_keys_and_json() -> None:
    runner = _bench(waving(), droppable=False)
    outcome = runner.run(_plan(runner))
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
    kept, dropped = (runner.run(_plan(runner)) for runner in (_bench(waving(), droppable=False), _bench(waving())))
    assert (kept.actions[3], dropped.actions[3]) == (TrackAction.CONSTANT, TrackAction.DROPPED)
    assert (kept.actions[4], dropped.actions[4]) == (TrackAction.CONSTANT, TrackAction.CONSTANT)
    assert kept.keys[3].values.tolist() == [[1, 1, 1]]
    assert kept.keys[4].values.tolist() == [[0.75, 0.75, 0.75]]
    assert 3 not in dropped.keys


def test_held_as_other_clips_hold_it() -> None:
    runner = _bench(
        clip(track("scale", [0, 1], [[1.2, 1.2, 1.2], [1.2001, 1.2, 1.2]], node=4)), shared=np.full(3, 1.2002)
    )
    outcome = runner.run(_plan(runner))
    assert outcome.actions.tolist() == [TrackAction.CONSTANT]
    assert outcome.keys[0].values[0] == pytest.approx([1.2002] * 3, rel=1e-6)


def test_chords_are_asked_where_they_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    """150° in a step or two would do along arcs; players that mix components cut the corner."""
    monkeypatch.setattr(time_axes, "MAX_BUDGET_PER_BOUND", math.inf)
    times = np.linspace(0, 2, 49)
    angles = np.radians(150) * times / 2
    values = np.stack((0 * angles, 0 * angles, np.sin(angles / 2), np.cos(angles / 2)), axis=1)
    runner = _bench(clip(track("rotation", times, values, node=1)))
    plan = _plan(runner, budget=2.0)
    cheap, thorough = runner.run(plan, smaller_than=0.0), runner.run(plan)
    assert cheap.worst < 0.2
    assert thorough.worst > 1
    assert cheap.size == thorough.size
    assert int(thorough.on[0].sum()) <= 3


def test_a_bound_on_angles() -> None:
    what = clip(track("rotation", np.linspace(0, 2, 25), turning(1.0), node=1))
    runner = _bench(what, bounds=Bounds(BOUND, 0.0, max_angle=math.radians(0.2)))
    outcome = runner.run(_plan(runner, budget=0.2))
    written = _clip(what, runner, outcome)
    a, b = (sample_pose(OF.skeleton, each, runner.source.at).rotation for each in (what, written))
    turned = np.degrees(quaternion.angle_between(a, b)[:, 1].max())
    assert float(outcome.own[0]) * 0.2 == pytest.approx(turned, rel=0.01)


def test_a_bound_on_speed() -> None:
    what = waving()
    plain = _bench(what)
    strict = _bench(what, bounds=Bounds(BOUND, 0.0, max_speed_error=0.01))
    slow, fast = plain.run(_plan(plain)), strict.run(_plan(strict))
    assert slow.worst <= 1
    assert fast.worst > slow.worst
    finer = strict.run(_plan(strict, budget=BOUND / 300))
    assert finer.worst < fast.worst


def test_tracks_stored_alike_count_once() -> None:
    """Joints 1 and 2 turn alike: the second costs but its channel."""
    times = np.linspace(0, 2, 25)
    both = _bench(clip(*(track("rotation", times, turning(1.0), node=node) for node in (1, 2))))
    alone = _bench(clip(track("rotation", times, turning(1.0), node=1)))
    pair, one = (runner.run(_plan(runner, axes="full")) for runner in (both, alone))
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
    runner = _bench(clip(*tracks, track("translation", times, np.sin(times[:, None] * [1, 2, 3]), node=1)))
    plan = _plan(runner, budget)
    full = runner.run(plan)
    asked: list[object] = []
    whole = Candidates.of

    def counted(self: Candidates, axis: SharedAxis, tolerances: Sequence[float]) -> object:
        asked.append(axis)
        return whole(self, axis, tolerances)

    monkeypatch.setattr(Candidates, "of", counted)
    assert runner.run_smaller(plan, full.size) is None
    assert bool(asked) == (apart == 1e-6 and budget < 1e-6)  # two in float32, which may have become one
    assert runner.run_smaller(plan, full.size + 1) is not None


def test_results_that_are_not_smaller_are_not_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    runner = _bench(waving())
    plan = _plan(runner)
    full = runner.run(plan)
    measured: list[object] = []

    def counted(*arguments: object) -> Floats:
        measured.append(arguments)
        return np.zeros(1)

    monkeypatch.setattr(BoundUsage, "_usage", counted)
    assert runner.run_smaller(plan, full.size) is None
    assert not measured
    assert runner.run_smaller(plan, full.size + 1) is not None
    assert measured


@pytest.mark.parametrize("target", RotationTarget)
def test_equal_decisions_are_measured_once(monkeypatch: pytest.MonkeyPatch, target: RotationTarget) -> None:
    plans = [_plan(runner := _bench(waving()), each * BOUND, rotation_target=target) for each in (1, 1.1, 2)]
    fresh = [_bench(waving()).run(plan, smaller_than=0) for plan in plans]
    counted = count_calls(monkeypatch, BoundUsage, "slerp_raw")
    found = [runner.run(plan, smaller_than=0) for plan in plans]
    assert len(counted) == 2
    for one, other in zip(found, fresh, strict=True):
        assert (one.size, one.plan is other.plan) == (other.size, True)
        np.testing.assert_array_equal(one.usage, other.usage)
        assert {i: each.name for i, each in one.keys.items()} == {i: each.name for i, each in other.keys.items()}
    assert runner.run_smaller(plans[1], found[1].size) is None
