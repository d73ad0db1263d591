"""The judgment on a written clip: the worst of all players, against every bound."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.measure.continuous_bound import prover as continuous_bound
from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip, Scene, TimeAxis
from anim.optimization.options import PLAYERS, Bounds, Reference
from anim.optimization.verification import Verification, verify_clips
from anim.sampling import players
from tests.clips import STEP, about, clip, skeleton, track

RULER = ErrorMetric(Scene(skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]]), ()))  # cubes of 2 cm around both nodes
TURN = clip(track("rotation", [0, 1], about("z", [0, 90])))
SLIDE = clip(track("translation", [0, 0.5, 1], [[0, 0, 0], [0, 1, 0], [0, 0, 0]]))


def _verify(before: Clip, after: Clip, **more: Any) -> Verification:
    (found,) = verify_clips(RULER, [(before, after)], **more)
    return found


def _verdict(
    before: Clip,
    after: Clip,
    bounds: Bounds,
    reference: Reference = Reference.CURVE,
    asked: tuple[str, ...] = PLAYERS,
) -> Verification:
    return _verify(before, after, bounds=bounds, reference=reference, players=asked)


def _lifted(height: float) -> Clip:
    (only,) = SLIDE.tracks
    return clip(replace(only, values=only.values + np.array([0, 0, height])))


@pytest.mark.parametrize(("bound", "holds"), [(0.02, True), (0.0101, True), (0.0099, False)])
def test_the_largest_distance_against_its_bound(bound: float, holds: bool) -> None:
    found = _verdict(SLIDE, _lifted(0.01), Bounds(bound, 0.0))
    assert found.error.max_error == pytest.approx(0.01, rel=2e-3)
    assert found.usage == pytest.approx(0.01 / bound, rel=2e-3)
    assert found.holds is holds


def test_the_worst_player_counts() -> None:
    """A quarter turn in one step, and in many: 0.92° apart, but only where components are mixed."""
    many = np.linspace(0, 1, 65)
    fine = clip(track("rotation", many, about("z", 90 * many)))
    spec, every = (_verdict(TURN, fine, Bounds(1.0, 0.0), asked=asked) for asked in (("spec",), PLAYERS))
    assert (spec.player, every.player) == ("spec", "nlerp")
    assert spec.error.max_error < 1e-5
    assert every.error.max_error == pytest.approx(np.radians(0.92), rel=0.05)


def test_keys_only() -> None:
    """Without its middle key the slide is wrong at 0.5 s; between a turn's keys nothing is looked at."""
    at_ends = clip(track("translation", [0, 1], np.zeros((2, 3))))
    assert not _verdict(SLIDE, at_ends, Bounds(0.5, 0.0), Reference.KEYS).holds
    jump = clip(track("rotation", [0, 1], about("z", [0, 90]), STEP))
    assert _verdict(TURN, jump, Bounds(1e-3, 0.0), Reference.KEYS).holds
    assert not _verdict(TURN, jump, Bounds(1e-3, 0.0)).holds


def test_other_ends_never_hold() -> None:
    (only,) = SLIDE.tracks
    later = clip(replace(only, time_axis=TimeAxis([0, 0.5, 1.0000001])))
    found = _verdict(SLIDE, later, Bounds(10.0, 0.0))
    assert (found.usage, found.holds) == (math.inf, False)


def test_a_bound_of_0_lets_rounding_pass_and_nothing_else() -> None:
    bounds = Bounds(0.0, 0.0)
    assert _verdict(SLIDE, SLIDE, bounds).usage == 0
    assert _verdict(SLIDE, _lifted(1e-12), bounds).holds
    assert not _verdict(SLIDE, _lifted(1e-7), bounds).holds


def test_turns_speeds_and_pointers_have_bounds_of_their_own() -> None:
    (only,) = TURN.tracks
    off = clip(replace(only, values=about("z", [0.5, 90.5])))
    loose = Bounds(1.0, 0.0)
    assert _verdict(TURN, off, loose).holds
    assert _verdict(TURN, off, replace(loose, max_angle=math.radians(0.51))).holds
    assert not _verdict(TURN, off, replace(loose, max_angle=math.radians(0.49))).holds
    slower = clip(replace(SLIDE.tracks[0], values=0.99 * SLIDE.tracks[0].values))  # 2 m/s, and 0.02 less
    assert _verdict(SLIDE, slower, replace(loose, max_speed_error=0.021)).holds
    assert not _verdict(SLIDE, slower, replace(loose, max_speed_error=0.019)).holds
    color = track("/materials/0/emissiveFactor", [0, 1], [[0, 0, 0], [1, 1, 1]])
    other = clip(replace(color, values=np.array([[0.01, 0, 0], [1, 1, 1]])))
    assert _verdict(clip(color), other, replace(loose, max_pointer_error=0.011)).holds
    assert not _verdict(clip(color), other, replace(loose, max_pointer_error=0.009)).holds


def test_a_bound_for_every_time() -> None:
    """A quarter turn in one step and in many, as components are mixed: between the times looked at it is no worse."""
    many = np.linspace(0, 1, 65)
    fine = clip(track("rotation", many, about("z", 90 * many)))
    plain, proven = (
        _verify(TURN, fine, bounds=Bounds(1.0, 0.0), reference=Reference.CURVE, prover=prover)
        for prover in (None, Prover(RULER))
    )
    assert plain.certified is None
    assert proven.certified is not None
    assert proven.error.max_error == pytest.approx(plain.error.max_error, rel=2e-3)
    assert proven.error.max_error <= proven.certified <= 1.01 * proven.error.max_error


def test_a_proof_needs_few_samples() -> None:
    """At 24 keys per second, 120 frames per second and the middles are six times as many; the result is the same."""
    times = np.arange(49) / 24
    before = clip(track("rotation", times, about("z", 40 * np.sin(3 * times))))
    after = clip(track("rotation", times[::4], about("z", 40 * np.sin(3 * times[::4]))))
    plain, proven = (
        _verify(before, after, bounds=Bounds(0.05, 0.0), reference=Reference.CURVE, prover=prover)
        for prover in (None, Prover(RULER))
    )
    assert proven.certified is not None
    assert 4 * proven.error.times < plain.error.times
    assert proven.error.max_error == pytest.approx(plain.error.max_error, rel=0.005)
    assert plain.error.max_error <= proven.certified


def test_a_loose_proof_of_few_samples_is_not_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its error would be that of few times, which may be far below the largest."""
    monkeypatch.setattr(continuous_bound, "MAX_REFINED_DEPTH", 0)
    times = np.arange(49) / 24
    before = clip(track("rotation", times, about("z", 40 * np.sin(3 * times))))
    after = clip(track("rotation", times[::4], about("z", 40 * np.sin(3 * times[::4]))))
    plain, proven = (
        _verify(before, after, bounds=Bounds(0.5, 0.0), reference=Reference.CURVE, prover=prover)
        for prover in (None, Prover(RULER))
    )
    assert proven.certified is not None
    assert proven.error.max_error == plain.error.max_error


def test_nothing_is_proven_where_the_bound_is_broken_or_only_keys_count() -> None:
    prover = Prover(RULER)
    for bound, reference in ((0.001, Reference.CURVE), (1.0, Reference.KEYS)):
        bounds = Bounds(bound, 0.0)
        assert _verify(SLIDE, _lifted(0.01), bounds=bounds, reference=reference, prover=prover).certified is None


def test_what_a_proof_comes_across_counts() -> None:
    """A key that is 1 ‰ too long shows in three.js on one side of its time only: 1.5 mm, just before it."""
    times = [0, 1, 2]
    keys = about("z", [0, 60, 61])
    before, after = (clip(track("rotation", times, keys * long)) for long in (1, np.array([[1], [1.001], [1]])))
    bounds = Bounds(0.0025, 0.0)
    plain, found = (
        _verify(before, after, bounds=bounds, reference=Reference.CURVE, players=("three",), prover=prover)
        for prover in (None, Prover(RULER))
    )
    assert plain.error.max_error < found.error.max_error
    assert found.error.time == np.nextafter(1, 0)
    tight = replace(bounds, max_error=(plain.error.max_error + found.error.max_error) / 2)
    assert plain.error.max_error < tight.max_error
    again = _verify(before, after, bounds=tight, reference=Reference.CURVE, players=("three",), prover=Prover(RULER))
    assert not again.holds


def test_every_player_that_is_known_is_asked() -> None:
    """three.js normalizes some joints and not others: on Fox, under a codec, 3 % beyond what the others show."""
    assert set(PLAYERS) == set(players.PLAYERS)


@pytest.mark.parametrize("prover", [None, Prover(RULER)])
@pytest.mark.parametrize("reference", list(Reference))
def test_clips_together_have_the_errors_that_each_has_alone(prover: Prover | None, reference: Reference) -> None:
    """Equal ones, near and far ones, a pointer, another end, and one that only dense samples prove."""
    many = np.linspace(0, 1, 65)
    pointer = clip(*SLIDE.tracks, track("/materials/0/pbrMetallicRoughness/metallicFactor", [0, 1], [[0], [1]]))
    pairs = [
        (SLIDE, SLIDE),
        (SLIDE, _lifted(0.01)),
        (TURN, clip(track("rotation", many, about("z", 90 * many)))),
        (SLIDE, _lifted(5.0)),
        (pointer, pointer),
        (SLIDE, TURN),
        (TURN, clip(track("rotation", [0, 2], about("z", [0, 90])))),
    ]
    more: dict[str, Any] = {"bounds": Bounds(0.05, 0.0), "reference": reference, "prover": prover}
    assert verify_clips(RULER, pairs, **more) == [_verify(*pair, **more) for pair in pairs]
    assert verify_clips(RULER, [], **more) == []
