"""Searches side by side: what is found for a clip is what is found for it alone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from anim.model import Clip
from anim.optimization.options import EFFORTS, Bounds, Packing, find_effort
from anim.optimization.search.context import Context
from anim.optimization.search.lockstep import SearchRequest, SearchResult, search_clips
from anim.optimization.search.plan import RotationTarget
from anim.optimization.search.trial import Trial
from anim.optimization.search.trial_batch import TrialBatch
from tests.anim.optimization.making import TIMES, nodding, scene, setting_of, stepping, turning, waving
from tests.calls import count_calls
from tests.clips import clip, track

OF = scene()
BOUND = 0.02  # m
TWIST = clip(*(track("rotation", TIMES, turning(0.8 + 0.3 * i, (i, 1, 0.3)), node=i) for i in range(4)))
CLIPS = (nodding(), waving(), stepping(), TWIST, nodding(times=np.linspace(0, 0.5, 3)))


def _request(what: Clip, number: int = 0) -> SearchRequest:
    """A search of all tracks; of some clips they may be dropped, or other tracks use a part of the bound."""
    count = len(what.tracks)
    constant = np.array([0.75, 0.75, 0.7499])
    shared = tuple((constant,) if each.path == "scale" else () for each in what.tracks)
    return SearchRequest(
        what, tuple(range(count)), BOUND, 0.1 * BOUND * (number % 2), np.full(count, number != 1), shared, frozenset()
    )


def _requests() -> list[SearchRequest]:
    return [_request(what, number) for number, what in enumerate(CLIPS)]


def _same(some: SearchResult | None, other: SearchResult | None) -> None:
    assert some is not None
    assert other is not None
    a, b = some.result, other.result
    assert (a.size, a.plan.axes, a.plan.rotation_target) == (b.size, b.plan.axes, b.plan.rotation_target)
    assert a.actions.tolist() == b.actions.tolist()
    assert sorted(a.keys) == sorted(b.keys)
    for i, keys in a.keys.items():
        assert (keys.form, keys.codes) == (b.keys[i].form, b.keys[i].codes)
        np.testing.assert_array_equal(keys.values, b.keys[i].values)
    assert {i: on.tolist() for i, on in a.on.items()} == {i: on.tolist() for i, on in b.on.items()}
    assert a.usage == pytest.approx(b.usage, rel=1e-4, abs=1e-4)
    assert a.own == pytest.approx(b.own, rel=1e-9)
    assert a.plan.budgets == pytest.approx(b.plan.budgets, rel=1e-4)


def _contexts() -> dict[str, Context]:
    bounds = {
        "plain": Bounds(BOUND, 0.02),
        "speed": Bounds(BOUND, 0.02, max_speed_error=0.1),
        "angle": Bounds(BOUND, 0.02, max_angle=math.radians(0.1)),
    }
    contexts = {name: setting_of(OF, CLIPS, bounds=each) for name, each in bounds.items()}
    for packing in (Packing.EXT, Packing.KHR):
        contexts[packing.value] = setting_of(OF, CLIPS, bounds=bounds["plain"], packing=packing)
    contexts["ext angle"] = setting_of(OF, CLIPS, bounds=bounds["angle"], packing=Packing.EXT)
    return contexts


CONTEXTS = _contexts()


def _check_together(context: Context, requests: list[SearchRequest], effort: str) -> None:
    tried = find_effort(effort, context.coding.packing)
    together = search_clips(context, requests, tried)
    for found, request in zip(together, requests, strict=True):
        (alone,) = search_clips(context, [request], tried)
        _same(found, alone)
    sizes = [found.result.size for found in together if found is not None]
    assert len(set(sizes)) == len(requests)


@pytest.mark.parametrize("name", CONTEXTS)
def test_a_clip_is_found_as_alone(name: str) -> None:
    _check_together(CONTEXTS[name], _requests(), "fast")


def test_a_clip_is_found_as_alone_with_more_effort() -> None:
    _check_together(CONTEXTS["ext"], [_request(each) for each in CLIPS[:2]], "balanced")


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTEXTS)
def test_every_clip_is_found_as_alone_with_more_effort(name: str) -> None:
    _check_together(CONTEXTS[name], _requests(), "balanced")


def test_the_order_of_clips_changes_nothing() -> None:
    context = CONTEXTS["ext"]
    there = search_clips(context, _requests(), EFFORTS["fast"])
    back = search_clips(context, _requests()[::-1], EFFORTS["fast"])[::-1]
    for a, b in zip(there, back, strict=True):
        _same(a, b)


@pytest.mark.slow
def test_some_searches_aim_at_the_world() -> None:
    """Else the comparisons above say nothing of it."""
    found = search_clips(CONTEXTS["ext"], _requests(), find_effort("balanced", Packing.EXT))
    targets = {each.result.plan.rotation_target for each in found if each is not None}
    assert RotationTarget.WORLD in targets


def test_bounds_on_angles_and_speeds_take_bytes() -> None:
    """Else the comparisons above say nothing of them."""
    sizes = {}
    for name in ("plain", "angle", "speed"):
        found = search_clips(CONTEXTS[name], _requests(), EFFORTS["fast"])
        sizes[name] = sum(each.result.size for each in found if each is not None)
    assert sizes["plain"] < min(sizes["angle"], sizes["speed"])


def test_a_clip_without_a_result_leaves_the_others_alone() -> None:
    context = CONTEXTS["plain"]
    requests = _requests()[:3]
    requests[1] = requests[1]._replace(bound=1e-13, spent=0.0)
    found = search_clips(context, requests, EFFORTS["fast"])
    assert found[1] is None
    for n in (0, 2):
        _same(found[n], search_clips(context, [requests[n]], EFFORTS["fast"])[0])


def _unequal_requests() -> list[SearchRequest]:
    """Of the second nothing is found, after many trials: float32 itself is too coarse."""
    return [_request(what)._replace(bound=bound) for what, bound in ((CLIPS[0], BOUND), (CLIPS[1], 1e-13))]


def test_all_clips_are_tried_in_one_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many steps as the clip with most trials takes, instead of the sum."""
    every = _unequal_requests()
    steps = []
    for requests in (every, every[:1], every[1:]):
        with monkeypatch.context() as patched:
            counted = count_calls(patched, TrialBatch, "run")
            search_clips(CONTEXTS["plain"], requests, EFFORTS["fast"])
            steps.append(len(counted))
    assert steps[0] == steps[2] > steps[1] + 10


def test_no_clips_are_asked_again_that_are_finished(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[int]] = []
    run = TrialBatch.run

    def watched(self: TrialBatch, requests: list[tuple[int, Trial]]) -> object:
        asked.append([clip for clip, _ in requests])
        return run(self, requests)

    monkeypatch.setattr(TrialBatch, "run", watched)
    search_clips(CONTEXTS["plain"], _unequal_requests(), EFFORTS["fast"])
    first = asked.index([1])
    assert asked[:first] == [[0, 1]] * first
    assert [each for each in asked[first:] if each] == [[1]] * sum(map(bool, asked[first:]))
    assert first > 0
