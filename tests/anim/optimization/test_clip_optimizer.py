"""One clip until it holds: searched, judged, tightened, and in the end kept without loss."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.model import Clip
from anim.optimization import clip_optimizer as site_
from anim.optimization.clip import Task, solve
from anim.optimization.clip_optimizer import ClipOptimizer, optimize_clip
from anim.optimization.options import Bounds, Request
from anim.optimization.search.context import Context
from anim.optimization.search.plan import Solution
from tests.anim.optimization.making import scene, waving
from tests.clips import about, clip, track

OF = scene()
BOUND = 0.05


def _site(max_error: float = BOUND) -> ClipOptimizer:
    return ClipOptimizer(Request(Bounds(max_error, 0.02), effort="fast"), OF, OF, (waving(),))


def _task(bound: float) -> Task:
    what = waving()
    return Task(what, ((),) * len(what.tracks), (False,) * len(what.tracks), bound)


def _keys(clip: Clip) -> int:
    return sum(len(track.times) for track in clip.tracks)


def test_what_holds_at_once_is_kept() -> None:
    found = optimize_clip(_site(), (0, _task(0.9 * BOUND)))
    assert found.verdict.holds
    assert found.verdict.error.max_error <= BOUND
    assert _keys(found.solution.clip) < _keys(waving())


def test_a_search_that_was_given_too_much_is_tightened(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three times the bound: the first result fails, a later one holds, with the worst vertices measured."""
    asked: list[tuple[float, int]] = []

    def watched(context: Context, task: Task) -> Solution | None:
        if context.bounds.max_error > 0:
            asked.append((task.bound, len(context.points)))
        return solve(context, task)

    monkeypatch.setattr(site_, "solve", watched)
    found = optimize_clip(_site(), (0, _task(3 * BOUND)))
    assert found.verdict.holds
    assert len(asked) > 1
    assert [bound for bound, _ in asked] == sorted((bound for bound, _ in asked), reverse=True)
    assert [count for _, count in asked] == sorted(count for _, count in asked)


def test_what_never_holds_is_kept_without_loss(monkeypatch: pytest.MonkeyPatch) -> None:
    def stubborn(context: Context, task: Task) -> Solution | None:
        return solve(context, task if context.bounds.max_error == 0 else replace(task, bound=100.0))

    monkeypatch.setattr(site_, "solve", stubborn)
    found = optimize_clip(_site(), (0, _task(BOUND)))
    assert found.verdict.holds
    assert found.verdict.error.max_error <= 1e-9


@pytest.mark.parametrize(("bytes_at_least", "searches"), [(1e9, [BOUND]), (0.0, [BOUND, 0.0])])
def test_no_search_without_loss_that_cannot_be_smaller(
    bytes_at_least: float, searches: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[float] = []

    def watched(context: Context, task: Task) -> Solution | None:
        asked.append(context.bounds.max_error)
        return solve(context, task)

    monkeypatch.setattr(site_, "solve", watched)
    monkeypatch.setattr(site_, "MAX_REDUCED_KEY_FRACTION", 0.0)
    monkeypatch.setattr(site_, "min_lossless_bytes", lambda *_: bytes_at_least)
    assert optimize_clip(_site(), (0, _task(0.9 * BOUND))).verdict.holds
    assert asked == searches


def test_below_float32_nothing_is_lost() -> None:
    found = optimize_clip(_site(1e-13), (0, _task(1e-13)))
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
    found = optimize_clip(optimizer, (0, Task(what, ((), ()), (False, False), 0.0197)))
    assert found.verdict.holds
    assert not found.without_loss
