"""Trials of several clips at once: each comes to what it comes to alone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from anim.optimization.options import Bounds, Objective, Packing
from anim.optimization.search.bound_usage import BoundUsage
from anim.optimization.search.plan import Plan, RotationTarget, TrialResult
from anim.optimization.search.time_axes import LAYOUTS
from anim.optimization.search.trial import Trial
from anim.optimization.tracks.quantization import BYTE_COSTS, Encoding
from tests.anim.optimization.making import TIMES, turning
from tests.anim.optimization.search.stacks import BOUND, CLIPS, Bench, bench
from tests.clips import about, clip, track

CHAIN = clip(*(track("rotation", TIMES, turning(1.1 + 0.2 * i, (i, 1, 0)), node=i) for i in range(4)))
EVERY = (*CLIPS, CHAIN)


def _same(some: TrialResult | None, other: TrialResult | None) -> None:
    assert some is not None
    assert other is not None
    assert some.size == other.size
    assert some.actions.tolist() == other.actions.tolist()
    assert sorted(some.keys) == sorted(other.keys)
    for i, keys in some.keys.items():
        assert (keys.form, keys.codes) == (other.keys[i].form, other.keys[i].codes)
        np.testing.assert_array_equal(keys.values, other.keys[i].values)
    assert {i: on.tolist() for i, on in some.on.items()} == {i: on.tolist() for i, on in other.on.items()}
    assert some.usage == pytest.approx(other.usage, rel=1e-4, abs=1e-4)
    assert some.own == pytest.approx(other.own, rel=1e-9)


def _plans(made: Bench, **more: object) -> list[Plan]:
    """A plan for each clip, all with other budgets."""
    return [made.plan(n, BOUND / (3 + n), **more) for n in range(len(EVERY))]


@pytest.mark.parametrize("bounds", [None, Bounds(BOUND, 0.0, max_speed_error=0.1), Bounds(BOUND, 0.0, max_angle=0.01)])
@pytest.mark.parametrize("packing", Packing)
@pytest.mark.parametrize("target", RotationTarget)
def test_trials_together_are_those_of_each_alone(
    target: RotationTarget, packing: Packing, bounds: Bounds | None
) -> None:
    coding = Encoding(packing, BYTE_COSTS[Objective.FILE])
    made = bench(*EVERY, bounds=bounds, coding=coding)
    plans = _plans(made, rotation_target=target)
    together = made.batch.run([(n, Trial(plan)) for n, plan in enumerate(plans)])
    for n, (found, what) in enumerate(zip(together, EVERY, strict=True)):
        alone = bench(what, bounds=bounds, coding=coding)
        _same(found, alone.run(plans[n]))
        assert found is not None
        assert found.plan is plans[n]


@pytest.mark.parametrize("axes", LAYOUTS)
def test_all_layouts_together(axes: str) -> None:
    made = bench(*EVERY)
    plans = _plans(made, axes=axes)
    together = made.batch.run([(n, Trial(plan)) for n, plan in enumerate(plans)])
    for found, plan, what in zip(together, plans, EVERY, strict=True):
        _same(found, bench(what).run(plan))


def test_different_trials_in_one_step() -> None:
    """Of three clips of four: other targets, layouts and budgets, one of them without a keyed track."""
    made = bench(*EVERY)
    plans = {
        0: made.plan(0, 100.0),
        1: made.plan(1, axes="full"),
        3: made.plan(3, axes="third", rotation_target=RotationTarget.WORLD),
    }
    found = made.batch.run([(n, Trial(plan)) for n, plan in plans.items()])
    for result, (n, plan) in zip(found, plans.items(), strict=True):
        _same(result, bench(EVERY[n]).run(plan))
    assert found[0] is not None
    assert found[0].on == {}


def test_limits_are_those_of_each_clip(monkeypatch: pytest.MonkeyPatch) -> None:
    """Results that take as many bytes are not measured; the others in the same step are."""
    made = bench(*EVERY)
    plans = _plans(made)
    sizes = [made.run(plan, n).size for n, plan in enumerate(plans)]
    measured: list[list[int]] = []
    play = BoundUsage.slerp_raw

    def watched(self: BoundUsage, shown: object, clips: object) -> object:
        measured.append(np.asarray(clips).tolist())
        return play(self, shown, clips)  # type: ignore[arg-type]

    monkeypatch.setattr(BoundUsage, "slerp_raw", watched)
    fresh = bench(*EVERY)
    trials = [Trial(plan, limit=sizes[n] + (n % 2)) for n, plan in enumerate(plans)]
    found = fresh.batch.run(list(enumerate(trials)))
    assert [each is None for each in found] == [True, False, True, False]
    assert measured == [[1, 3]]
    for n in (1, 3):
        _same(found[n], made.run(plans[n], n))


def test_chords_are_measured_where_they_matter_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the clips in one step: those with large turns, within the bounds, with fewer bytes than asked for."""
    times = np.linspace(0, 2, 25)
    still = clip(track("translation", times, np.outer(np.sin(9 * times), [1.0, 0, 0]), node=0))
    bent = clip(track("rotation", [0, 1, 2], about("z", [0, 74, 0]), node=1))
    measured: list[list[int]] = []
    play = BoundUsage.nlerp

    def watched(self: BoundUsage, shown: object, clips: object) -> object:
        measured.append(np.asarray(clips).tolist())
        return play(self, shown, clips)  # type: ignore[arg-type]

    monkeypatch.setattr(BoundUsage, "nlerp", watched)
    made = bench(still, bent, bent, bent)
    plans = [made.plan(n, BOUND / 100, axes="full") for n in range(4)]
    limits = (math.inf, math.inf, 0.0, math.inf)
    made.batch.run([(n, Trial(plan, smaller_than=limits[n])) for n, plan in enumerate(plans)])
    assert measured == [[1, 3]]


def test_leeway_is_that_of_each_clip_alone() -> None:
    made = bench(*EVERY)
    for n, what in enumerate(EVERY):
        assert made.batch.leeway(n) == pytest.approx(bench(what).batch.leeway(0), rel=1e-9)
    assert max(made.batch.leeway(3)) > 1
