"""The judgment on a written clip: the worst of all players, against every bound."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from anim.measure import players
from anim.measure.error import Ruler
from anim.model import Clip, Scene
from anim.optimize.limits import Bounds, Reference
from anim.optimize.verify import PLAYERS, Verdict, verdict
from tests.clips import STEP, about, clip, skeleton, track

RULER = Ruler(Scene(skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]]), ()))  # cubes of 2 cm around both nodes
TURN = clip(track("rotation", [0, 1], about("z", [0, 90])))
SLIDE = clip(track("translation", [0, 0.5, 1], [[0, 0, 0], [0, 1, 0], [0, 0, 0]]))


def _verdict(
    before: Clip,
    after: Clip,
    bounds: Bounds,
    reference: Reference = Reference.CURVE,
    asked: tuple[str, ...] = PLAYERS,
) -> Verdict:
    return verdict(RULER, before, after, bounds=bounds, reference=reference, players=asked)


def _lifted(height: float) -> Clip:
    (only,) = SLIDE.tracks
    return clip(replace(only, values=only.values + np.array([0, 0, height])))


@pytest.mark.parametrize(("bound", "holds"), [(0.02, True), (0.0101, True), (0.0099, False)])
def test_the_largest_distance_against_its_bound(bound: float, holds: bool) -> None:
    found = _verdict(SLIDE, _lifted(0.01), Bounds(bound, 0.0))
    assert found.error.max_error == pytest.approx(0.01, rel=2e-3)
    assert found.strain == pytest.approx(0.01 / bound, rel=2e-3)
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
    later = clip(replace(only, times=np.array([0, 0.5, 1.0000001])))
    found = _verdict(SLIDE, later, Bounds(10.0, 0.0))
    assert (found.strain, found.holds) == (math.inf, False)


def test_a_bound_of_0_lets_rounding_pass_and_nothing_else() -> None:
    bounds = Bounds(0.0, 0.0)
    assert _verdict(SLIDE, SLIDE, bounds).strain == 0
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


def test_every_player_that_is_known_is_asked() -> None:
    """three.js normalizes some joints and not others: on Fox, under a codec, 3 % beyond what the others show."""
    assert set(PLAYERS) == set(players.PLAYERS)
