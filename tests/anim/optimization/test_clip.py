"""One clip as a whole: what becomes of each kind of track."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.model import Clip, Interpolation, Scene, Skeleton, Track
from anim.optimization.options import Drop, Packing, Policy
from anim.optimization.search.plan import Solution
from anim.optimization.tracks.key_reduction import INT16
from anim.sampling.track import sample
from tests.anim.optimization.making import TIMES, scene, setting_of, solved, task_of, turning, waving
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, clip, track

OF = scene()
REST = OF.skeleton


def _solved(
    what: Clip,
    *,
    policy: Policy | None = None,
    max_error: float = 1e-3,
    unused: bool = False,
    packing: Packing = Packing.CORE,
    of: Scene = OF,
) -> Solution:
    context = setting_of(of, [what], max_error=max_error, policy=policy, packing=packing)
    found = solved(context, task_of(what, max_error, unused=unused))
    assert found is not None
    assert (found.clip.name, found.clip.start, found.clip.end) == (what.name, what.start, what.end)
    assert len(found.stored) == len(found.clip.tracks) >= 1
    return found


def _by_target(what: Clip) -> Mapping[tuple[int | None, str], Track]:
    return {each.target: each for each in what.tracks}


@pytest.mark.parametrize("packing", list(Packing))
@pytest.mark.parametrize("max_error", [1e-1, 1e-3])
def test_the_bound_holds(packing: Packing, max_error: float) -> None:
    what = waving()
    found = _solved(what, packing=packing, max_error=max_error)
    for player in ("spec", "three", "raw", "nlerp"):
        error = ErrorMetric(OF).error_at(what, found.clip, dense_times(what, found.clip), player=player)
        assert error.max_error <= 1.1 * max_error  # the middles of gaps were looked at; the written file is verified
    assert sum(len(t.times) for t in found.clip.tracks) < 0.7 * sum(len(t.times) for t in what.tracks)


@pytest.mark.parametrize(
    ("drop", "unused", "gone"),
    [(Drop.REST, False, 1), (Drop.UNUSED, True, 1), (Drop.UNUSED, False, 0), (Drop.NEVER, True, 0)],
)
def test_what_rests_goes_by_the_policy(drop: Drop, unused: bool, gone: int) -> None:
    found = _solved(waving(), policy=Policy(drop), unused=unused)
    assert found.dropped == (3,)[:gone]
    if not gone:
        assert len(_by_target(found.clip)[3, "scale"].times) == 1
    assert len(_by_target(found.clip)[4, "scale"].times) == 1


def test_steps_stay_steps_with_every_jump() -> None:
    jumps = track("translation", [0, 0.5, 1, 1.5], np.outer([0, 0, 1e-5, 0.5], [1, 0, 0]), STEP, node=1)
    found = _by_target(_solved(clip(jumps, *waving().tracks[:2])).clip)[1, "translation"]
    assert found.interpolation is STEP
    at = np.linspace(0, 2, 999)
    assert (sample(found, at) == sample(jumps, at)).all()


def test_kept_nodes_are_exact() -> None:
    what = waving()
    found = _by_target(_solved(what, policy=Policy(Drop.REST, keep=frozenset({1, 3})), max_error=0.1).clip)
    at = np.linspace(-1, 3, 999)
    for target in ((1, "rotation"), (3, "scale")):
        assert np.abs(sample(found[target], at) - sample(_by_target(what)[target], at)).max() < 1e-12
    assert len(found[2, "rotation"].times) < 20


def test_unseen_nodes_go_only_where_that_is_asked_for() -> None:
    parts: dict[str, Any] = {
        path: np.vstack((getattr(REST, path), row))
        for path, row in (("translation", [0, 1, 0]), ("rotation", [0, 0, 0, 1]), ("scale", [1, 1, 1]))
    }
    socket = replace(REST, names=(*REST.names, "socket"), parents=np.r_[REST.parents, 2], **parts)
    of = replace(OF, skeleton=socket)
    number = len(socket) - 1
    what = clip(*waving().tracks, track("rotation", TIMES, turning(1.0), node=number))
    last = len(what.tracks) - 1
    assert last not in _solved(what, of=of).dropped
    assert last in _solved(what, of=of, policy=Policy(drop_invisible=True)).dropped
    kept = Policy(drop_invisible=True, keep=frozenset({number}))
    assert (
        _by_target(_solved(what, of=of, policy=kept).clip)[number, "rotation"].values == what.tracks[-1].values
    ).all()


def test_a_clip_of_rests_keeps_a_track_and_its_length() -> None:
    still = clip(*(track("scale", [0.5, 2], np.ones((2, 3)), node=node) for node in range(3)), name="t-pose")
    found = _solved(still, policy=Policy(Drop.REST))
    assert len(found.clip.tracks) == 1
    assert found.dropped == (1, 2)
    assert (found.clip.tracks[0].values == 1).all()


def test_a_clip_of_one_key() -> None:
    posed = clip(track("rotation", [0.75], about("x", [30]), node=1), name="pose")
    (only,) = _solved(posed, max_error=1e-6).clip.tracks
    assert only.times.tolist() == [0.75]
    assert only.values == pytest.approx(about("x", [30]), abs=1e-6)


@pytest.mark.parametrize("max_error", [0.0, 1e-2])
@pytest.mark.parametrize("keep", [frozenset[int](), frozenset({1})])
def test_ends_stay_where_what_held_them_goes(max_error: float, keep: frozenset[int]) -> None:
    """A turn from 0.5 to 1 s, and a resting track from 0 to 2 s that gave the clip its length."""
    turn = track("rotation", [0.5, 0.625, 1], about("y", [0, 60, 90]), node=1)
    still = track("scale", [0, 2], np.ones((2, 3)), node=2)
    found = _solved(clip(turn, still), max_error=max_error, policy=Policy(Drop.REST, keep=keep))
    written = _by_target(found.clip)[1, "rotation"]
    at = np.linspace(0, 2, 400)
    assert written.interpolation is LINEAR
    assert np.abs(np.abs((sample(written, at) * sample(turn, at)).sum(axis=1)) - 1).max() < 1e-4


def test_a_spline_stays_where_lines_take_more_bytes() -> None:
    slopes = np.array([[0, 3, 0], [2, 0, 0.0]])
    spline = track("translation", [0, 2], [[0, 0, 0], [1, 1, 0]], CUBICSPLINE, tangents=(slopes, slopes), node=0)
    turn = waving().tracks[1]
    for bound in (1e-4, 1e-2):  # too bent for any lines between frames; and for lines of fewer bytes
        found = _by_target(_solved(clip(spline, turn), max_error=bound).clip)
        assert found[0, "translation"].interpolation is CUBICSPLINE
        assert (found[0, "translation"].values == spline.values).all()
    assert found[1, "rotation"].storage == INT16  # the rest of the clip is searched all the same
    loose = _by_target(_solved(clip(spline), max_error=1.0).clip)[0, "translation"]
    assert loose.interpolation is LINEAR


def test_splines_stay_where_the_lines_of_all_take_more_bytes() -> None:
    """On the dense axis of lines each costs less than a spline; with the spline kept, the turn needs no such axis."""
    at = np.linspace(0, 2, 9)
    jumps = track("scale", at, 1 + 0.1 * (np.arange(9) % 2)[:, None] * np.ones(3), STEP, node=2)
    turn = track("rotation", at, about("z", 30 * np.sin(7 * at)), node=1)
    knots, tangents = about("x", np.array([0, 40, 10, 60])), np.zeros((4, 4))
    spline = track("rotation", np.linspace(0, 2, 4), knots, CUBICSPLINE, tangents=(tangents, tangents), node=0)
    what = clip(jumps, turn, spline)
    found = _by_target(_solved(what, max_error=0.05).clip)
    assert found[0, "rotation"].interpolation is CUBICSPLINE
    assert found[1, "rotation"].storage == INT16
    assert found[1, "rotation"].time_axis is found[2, "scale"].time_axis


def test_turns_far_from_unit_length_are_left_alone() -> None:
    """Players that don't normalize show another motion; which one was meant nobody knows."""
    bent = track("rotation", TIMES, 1.01 * turning(1.0), node=1)
    assert (_by_target(_solved(clip(bent)).clip)[1, "rotation"].values == bent.values).all()


def test_nothing_is_found_below_float32() -> None:
    what = waving()
    context = setting_of(OF, [what], max_error=1e-13)
    assert solved(context, task_of(what, 1e-13)) is None


def test_pointers_go_along() -> None:
    color = track("/materials/0/emissiveFactor", TIMES, np.outer(TIMES, [1, 2, 3.0]))
    found = _by_target(_solved(clip(color, *waving().tracks[:1])).clip)[None, "/materials/0/emissiveFactor"]
    assert len(found.times) == 2
    assert found.interpolation is Interpolation.LINEAR


def test_rest_is_the_skeletons() -> None:
    skeleton: Skeleton = OF.skeleton
    resting = clip(track("rotation", [0, 2], -np.tile(skeleton.rotation[2], (2, 1)), node=2), waving().tracks[1])
    assert _solved(resting, policy=Policy(Drop.REST)).dropped == (0,)  # −q is the same turn
