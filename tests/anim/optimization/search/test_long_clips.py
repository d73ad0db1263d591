"""Long clips, searched in parts: as good within the bound, with what holds for whole clips."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.model import Clip, Interpolation
from anim.optimization.clip_optimizer import ClipOptimizer, ClipResult
from anim.optimization.optimize_clips import optimize_clips
from anim.optimization.options import EFFORTS, Bounds, Drop, Packing, Policy, Reference, Request
from anim.optimization.search import long_clips
from anim.optimization.search.clip_parts import cut_clip, find_cuts
from anim.optimization.search.lockstep import SearchRequest, search_clips
from anim.optimization.search.long_clips import search_all
from anim.optimization.search.plan import FoundKeys, TrackAction
from anim.optimization.search.source_analysis import FreeTracks, analyze_sources
from anim.optimization.tracks.clip_ends import opened_tracks
from anim.sampling.pose import sample_pose
from tests.anim.optimization.making import scene, setting_of, task_of, turning, waving
from tests.calls import count_calls
from tests.clips import about, clip, track

OF = scene()
BOUND = 0.02  # m
TIMES = np.arange(601) / 30  # s
PARTS = 5


def _walking() -> Clip:
    """Twenty seconds: joint 1 swings without end, joint 2 moves in the second half only, joint 4 stays elsewhere."""
    late = np.where(TIMES > 10, 40 * np.sin(3 * (TIMES - 10)), 0.0)
    return clip(
        track("translation", TIMES, np.stack((0.1 * TIMES, np.sin(2 * TIMES), 0 * TIMES), axis=1), node=0),
        track("rotation", TIMES, turning(1.5, times=TIMES), node=1),
        track("rotation", TIMES, about("x", late), node=2),
        track("scale", TIMES, np.ones((len(TIMES), 3)), node=3),
        track("scale", TIMES, np.full((len(TIMES), 3), 0.75), node=4),
        name="walk",
    )


@pytest.fixture(autouse=True)
def _short_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_clips, "MAX_WHOLE_MATRICES", 1)
    monkeypatch.setattr(long_clips, "PART_MATRICES", 1)
    monkeypatch.setattr(long_clips, "MIN_PART_KEYS", 150)


def _request(what: Clip) -> SearchRequest:
    count = len(what.tracks)
    return SearchRequest(what, tuple(range(count)), BOUND, 0.0, np.ones(count, np.bool_), ((),) * count, frozenset())


def _found(what: Clip, effort: str = "fast", **more: Any) -> FoundKeys:
    (found,) = search_all(
        setting_of(OF, (what,), bounds=Bounds(BOUND, 0.02), **more), [_request(what)], EFFORTS[effort]
    )
    assert found is not None
    return found


def _optimized(what: Clip, packing: Packing = Packing.CORE) -> ClipResult:
    request = Request(Bounds(BOUND, 0.02), Policy(Drop.REST), packing, effort="fast")
    (result,) = optimize_clips(ClipOptimizer(request, OF, OF, (what,)), [(0, task_of(what, 0.95 * BOUND))])
    return result


@pytest.mark.parametrize("packing", Packing)
def test_the_bound_holds_over_all_parts(packing: Packing, monkeypatch: pytest.MonkeyPatch) -> None:
    searched = count_calls(monkeypatch, long_clips, "search_clips")
    found = _optimized(_walking(), packing)
    assert len(searched) == PARTS
    assert found.verdict.holds
    assert not found.without_loss
    keys = sum(len(each.times) for each in found.solution.clip.tracks)
    assert keys < 0.2 * sum(len(each.times) for each in _walking().tracks)
    assert not opened_tracks(_walking(), found.solution.clip)


def test_what_is_still_in_all_parts_needs_one_key_or_none() -> None:
    found = _found(_walking())
    assert found.actions.tolist() == [TrackAction.KEYED] * 3 + [TrackAction.DROPPED, TrackAction.CONSTANT]
    assert found.keys[4].values == pytest.approx(0.75)
    assert sorted(found.on) == [0, 1, 2]


def test_where_parts_meet_there_is_a_key_with_the_sources_value() -> None:
    what = _walking()
    found = _found(what)
    cuts = np.linspace(0, len(found.grid) - 1, PARTS + 1).round().astype(int)
    pose = sample_pose(OF.skeleton, what, found.grid[cuts])
    for i in (0, 1, 2):
        at = np.flatnonzero(found.on[i])
        assert set(cuts) <= set(at)
        true = getattr(pose, what.tracks[i].path)[:, what.tracks[i].node]
        assert np.abs(found.keys[i].values[np.searchsorted(at, cuts)]) == pytest.approx(np.abs(true), abs=1e-4)
        assert len(found.keys[i].values) == len(at)


def test_a_track_that_moves_in_some_parts_has_few_keys_in_the_others() -> None:
    on = _found(_walking()).on[2]
    assert on[:240].sum() <= 3 * 2 + 2
    assert on[300:].sum() > 20


def test_tracks_share_an_axis_over_all_parts() -> None:
    """The groups of the part with the most motion are those of all."""
    swing = turning(1.5, times=TIMES)
    noise = np.random.default_rng(3).normal(0, 0.5, len(TIMES))
    what = clip(
        track("rotation", TIMES, swing, node=1),
        track("rotation", TIMES, swing[:, [1, 2, 0, 3]], node=2),
        track("rotation", TIMES, about("x", 20 * np.sin(9 * TIMES) + noise), node=3),
    )
    found = _found(what)
    assert (found.on[0] == found.on[1]).all()
    assert (found.on[0] != found.on[2]).any()


def test_a_part_without_a_result_keeps_the_sources_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    """And the others do not: one bad second costs no more than itself."""
    answers = iter([False, True, True, False, True])
    monkeypatch.setattr(long_clips, "search_clips", lambda *given: search_clips(*given) if next(answers) else [None])
    found = _optimized(_walking())
    assert found.verdict.holds
    assert not found.without_loss
    swing = next(each for each in found.solution.clip.tracks if each.target == (1, "rotation"))
    counts = np.histogram(swing.times, np.linspace(0, 20, PARTS + 1))[0]
    assert sorted(counts > 100).count(True) == 2
    assert counts.min() < 30


def test_nothing_is_searched_if_all_tracks_keep_the_sources_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    """As those do that turn by half a turn between keys, at which nothing is cut."""
    searched = count_calls(monkeypatch, long_clips, "search_clips")
    times = np.arange(500) / 30
    turns = about("x", np.resize([0, 170, 20], 250))
    what = clip(*(track("rotation", times[i::2], turns, node=1 + i) for i in range(2)))
    found = _found(what)
    assert not searched
    assert [int(found.on[i].sum()) for i in range(2)] == [250, 250]


def test_a_rotation_that_changes_its_sign_stays_constant() -> None:
    sides = np.where(np.arange(len(TIMES)) >= 300, -1.0, 1.0)
    what = clip(
        track("rotation", TIMES, about("x", np.full(len(TIMES), 40.0)) * sides[:, None], node=1),
        track("rotation", TIMES, turning(1.5, times=TIMES), node=2),
    )
    assert _found(what).actions.tolist() == [TrackAction.CONSTANT, TrackAction.KEYED]


@pytest.mark.parametrize(("path", "expected"), [("rotation", TrackAction.CONSTANT), ("translation", TrackAction.KEYED)])
def test_opposite_constants_are_one_rotation_and_two_places(path: str, expected: TrackAction) -> None:
    value = np.array([0.0, 0.6, 0.8])
    at, none = np.arange(2), np.zeros((2, 3))
    parts = [long_clips._PartKeys(TrackAction.CONSTANT, sign * value, at, none, 0.1) for sign in (1, -1)]
    assert long_clips._joint_action(parts, path) is expected


def test_parts_meet_where_most_tracks_have_keys() -> None:
    times = np.arange(1001) / 64
    tracks = [track("translation", at, np.zeros((len(at), 3)), node=i) for i, at in enumerate((times, times[::60]))]
    assert find_cuts(tracks, times, 250).tolist() == [0, 180, 420, 600, 780, 1000]
    assert find_cuts(tracks[:1], times, 250).tolist() == [0, 200, 400, 600, 800, 1000]


def test_short_clips_beside_a_long_one_are_searched_as_always(monkeypatch: pytest.MonkeyPatch) -> None:
    what = (_walking(), waving())
    context = setting_of(OF, what, bounds=Bounds(BOUND, 0.02))
    searched = count_calls(monkeypatch, long_clips, "search_clips")
    together = search_all(context, [_request(each) for each in what], EFFORTS["fast"])
    assert len(searched) == 1 + PARTS
    (alone,) = search_clips(context, [_request(waving())], EFFORTS["fast"])
    assert together[1] is not None
    assert alone is not None
    assert {i: on.tolist() for i, on in together[1].on.items()} == {i: on.tolist() for i, on in alone.found.on.items()}


@pytest.mark.parametrize("degrees", [1.0, 120.0])
def test_few_keys_beside_many_are_no_trouble_where_parts_meet(degrees: float) -> None:
    """Whether parts without a key of the source move in an arc that a key would bend in some players, or hardly."""
    what = clip(
        track("translation", TIMES, np.stack((TIMES, np.sin(TIMES), 0 * TIMES), axis=1), node=0),
        track("rotation", TIMES[[2, 340, 595]], about("x", [0, degrees, 0]), node=1),
    )
    found = _optimized(what)
    assert found.verdict.holds
    assert not found.without_loss
    assert sum(len(each.times) for each in found.solution.clip.tracks) < 200


@pytest.mark.parametrize("whole", [1, 10**9])
def test_few_keys_far_apart_stay_those_of_the_source(whole: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter turn every two seconds beside dense keys, of which more would be wrong in some players."""
    monkeypatch.setattr(long_clips, "MAX_WHOLE_MATRICES", whole)
    what = clip(
        track("translation", TIMES, np.stack((0.1 * TIMES, np.sin(2 * TIMES), 0 * TIMES), axis=1), node=0),
        track("rotation", TIMES[::60], about("x", [0, 90] * 5 + [0]), node=1),
        track("rotation", TIMES, turning(1.5, times=TIMES), node=2),
    )
    found = _optimized(what)
    assert found.verdict.holds
    assert not found.without_loss
    assert sum(len(each.times) for each in found.solution.clip.tracks) < 400


def test_parts_have_keys_at_their_ends_on_axes_of_source_keys_too() -> None:
    what = clip(
        track("translation", TIMES, np.stack((TIMES, 0 * TIMES, 0 * TIMES), axis=1), node=0),
        track("rotation", TIMES[[0, 300, 600]], about("x", [0, 30, 0]), node=1),
    )
    part = FreeTracks(what, (0, 1), 1e-4, TIMES[150:301])
    context = setting_of(OF, (what,))
    (source,) = analyze_sources(OF.skeleton, [part], context.points, context.answering, reference=Reference.KEYS)
    assert np.flatnonzero(source.own[1]).tolist() == [0, 150]


@pytest.mark.parametrize("start", [0.0, 0.04, 3.2, 19.9])
def test_a_part_of_a_clip_plays_like_the_clip(start: float) -> None:
    """Of lines, steps and splines, some of which begin later or end earlier."""
    values = np.random.default_rng(1).normal(size=(len(TIMES), 3))
    tangents = values[::-1], values[::-1]
    what = clip(
        track("translation", TIMES[40:500:3], values[40:500:3], node=0),
        track("translation", TIMES[::7], values[::7], Interpolation.STEP, node=1),
        track("translation", TIMES, values, Interpolation.CUBICSPLINE, node=2, tangents=tangents),
        track("rotation", TIMES[30:31], about("x", [20]), node=3),
    )
    at = np.linspace(start, start + 0.1, 60)
    part = cut_clip(what, at[0], at[-1])
    assert max(len(each.times) for each in part.tracks) <= 6
    whole, found = (sample_pose(OF.skeleton, each, at) for each in (what, part))
    np.testing.assert_allclose(found.translation, whole.translation, atol=1e-12)
    np.testing.assert_allclose(found.rotation, whole.rotation, atol=1e-12)


@pytest.mark.parametrize("effort", ["balanced", "max"])
@pytest.mark.slow
def test_more_effort_keeps_the_groups(effort: str) -> None:
    found = _found(_walking(), effort, packing=Packing.EXT)
    assert len(found.on) == 3
