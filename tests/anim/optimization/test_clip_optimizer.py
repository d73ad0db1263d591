"""One clip until it holds: searched, judged, tightened, and in the end kept without loss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from anim.model import Clip
from anim.optimization import optimize_clips as site_
from anim.optimization.clip import Solving, Task, solve
from anim.optimization.clip_optimizer import ClipOptimizer, ClipResult
from anim.optimization.optimize_clips import optimize_clips
from anim.optimization.options import Bounds, Effort, Packing, Request
from anim.optimization.search.context import Context
from anim.optimization.search.lockstep import SearchRequest
from anim.optimization.search.long_clips import search_all
from anim.optimization.search.plan import FoundKeys
from tests.anim.optimization.making import nodding, scene, stepping, task_of, waving
from tests.clips import about, clip, track

OF = scene()
BOUND = 0.05


def _site(max_error: float = BOUND) -> ClipOptimizer:
    return ClipOptimizer(Request(Bounds(max_error, 0.02), effort="fast"), OF, OF, (waving(),))


def _task(bound: float) -> Task:
    return task_of(waving(), bound)


def _optimized(optimizer: ClipOptimizer, task: Task) -> ClipResult:
    (found,) = optimize_clips(optimizer, [(0, task)])
    return found


def _keys(clip: Clip) -> int:
    return sum(len(track.times) for track in clip.tracks)


def test_what_holds_at_once_is_kept() -> None:
    found = _optimized(_site(), _task(0.9 * BOUND))
    assert found.verdict.holds
    assert found.verdict.error.max_error <= BOUND
    assert _keys(found.solution.clip) < _keys(waving())


def test_a_search_that_was_given_too_much_is_tightened(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three times the bound: the first result fails, a later one holds, with the worst vertices measured."""
    asked: list[tuple[float, int]] = []

    def watched(context: Context, task: Task) -> Solving:
        if context.bounds.max_error > 0:
            asked.append((task.bound, len(context.points)))
        return solve(context, task)

    monkeypatch.setattr(site_, "solve", watched)
    found = _optimized(_site(), _task(3 * BOUND))
    assert found.verdict.holds
    assert len(asked) > 1
    assert [bound for bound, _ in asked] == sorted((bound for bound, _ in asked), reverse=True)
    assert [count for _, count in asked] == sorted(count for _, count in asked)


def test_what_never_holds_is_kept_without_loss(monkeypatch: pytest.MonkeyPatch) -> None:
    def stubborn(context: Context, task: Task) -> Solving:
        return solve(context, task if context.bounds.max_error == 0 else replace(task, bound=100.0))

    monkeypatch.setattr(site_, "solve", stubborn)
    found = _optimized(_site(), _task(BOUND))
    assert found.verdict.holds
    assert found.verdict.error.max_error <= 1e-9


@pytest.mark.parametrize("scale", [1e18, 1e30])
def test_coordinates_beyond_float32_are_kept_without_loss(scale: float) -> None:
    far = replace(OF, skeleton=replace(OF.skeleton, scale=OF.skeleton.scale * scale))
    request = Request(Bounds(BOUND * scale, 0.02), effort="fast")
    found = _optimized(ClipOptimizer(request, far, far, (waving(),)), _task(1))
    assert found.without_loss


@pytest.mark.parametrize(("bytes_at_least", "searches"), [(1e9, [BOUND]), (0.0, [BOUND, 0.0])])
def test_no_search_without_loss_that_cannot_be_smaller(
    bytes_at_least: float, searches: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[float] = []

    def watched(context: Context, task: Task) -> Solving:
        asked.append(context.bounds.max_error)
        return solve(context, task)

    monkeypatch.setattr(site_, "solve", watched)
    monkeypatch.setattr(site_, "MAX_REDUCED_KEY_FRACTION", 0.0)
    monkeypatch.setattr(site_, "min_lossless_bytes", lambda *_: bytes_at_least)
    assert _optimized(_site(), _task(0.9 * BOUND)).verdict.holds
    assert asked == searches


def test_below_float32_nothing_is_lost() -> None:
    found = _optimized(_site(1e-13), _task(1e-13))
    assert found.verdict.usage <= 1
    by_target = {track.target: track for track in found.solution.clip.tracks}
    for each in waving().tracks:
        if len(by_target[each.target].times) > 1:
            assert (by_target[each.target].values == each.values).all()


def test_large_turns_on_one_of_two_axes() -> None:
    """A joint snaps round by 150° between two keys: players that mix by components cut that corner, and any key on the
    arc between, at times that only the other track has, would show them another way."""
    times = np.linspace(0, 2, 21)
    snap = track("rotation", times, about("z", [0, 150] * 10 + [0]), node=1)
    sway = track("translation", np.linspace(0, 2, 17), np.outer(np.sin(np.arange(17)), [1.0, 0, 0]), node=0)
    what = clip(snap, sway)
    optimizer = ClipOptimizer(Request(Bounds(0.02, 0.02), effort="fast"), OF, OF, (what,))
    found = _optimized(optimizer, task_of(what, 0.0197))
    assert found.verdict.holds
    assert not found.without_loss


CLIPS = (nodding(), waving(), stepping(), nodding(times=np.linspace(0, 0.5, 3)))


def _same(some: ClipResult, other: ClipResult) -> None:
    assert some.without_loss == other.without_loss
    assert some.solution.dropped == other.solution.dropped
    for a, b in zip(some.solution.clip.tracks, other.solution.clip.tracks, strict=True):
        assert (a.target, a.interpolation, a.storage) == (b.target, b.interpolation, b.storage)
        assert (a.times.tolist(), a.values.tolist()) == (b.times.tolist(), b.values.tolist())
    assert some.verdict.error == other.verdict.error


@pytest.mark.parametrize("packing", Packing)
def test_clips_together_are_optimized_as_each_alone(packing: Packing) -> None:
    """Two of them with a bound that other tasks don't have, which no search keeps and which is left without loss."""
    optimizer = ClipOptimizer(Request(Bounds(BOUND, 0.02), packing=packing, effort="fast"), OF, OF, CLIPS)
    bounds = (0.9 * BOUND, 0.8 * BOUND, 1e-13, 0.9 * BOUND)
    tasks = [(n, task_of(CLIPS[n], bounds[n])) for n in (2, 0, 1, 3)]
    found = optimize_clips(optimizer, tasks)
    assert [each.without_loss for each in found] == [True, False, False, False]
    for each, task in zip(found, tasks, strict=True):
        _same(each, optimize_clips(optimizer, [task])[0])


def test_some_clips_are_tightened_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those whose first results fail are searched again together, and the others are finished."""
    searched: list[list[str]] = []

    def watched(context: Context, requests: Sequence[SearchRequest], effort: Effort) -> list[FoundKeys | None]:
        searched.append([each.clip.name for each in requests])
        return search_all(context, requests, effort)

    monkeypatch.setattr(site_, "search_all", watched)
    optimizer = ClipOptimizer(Request(Bounds(BOUND, 0.02), effort="fast"), OF, OF, CLIPS)
    tasks = [(n, task_of(CLIPS[n], factor * BOUND)) for n, factor in enumerate((3, 0.8, 3))]
    found = optimize_clips(optimizer, tasks)
    assert all(each.verdict.holds and not each.without_loss for each in found)
    assert searched[0] == ["nod", "wave", "step"]
    assert searched[1] == ["nod", "step"]
    for n in (0, 2):
        alone = optimize_clips(optimizer, tasks[n : n + 1])[0]
        assert _keys(found[n].solution.clip) == pytest.approx(_keys(alone.solution.clip), rel=0.1)


def test_no_clips_at_all() -> None:
    assert optimize_clips(_site(), []) == []
