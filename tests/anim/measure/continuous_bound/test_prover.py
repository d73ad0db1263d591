"""The bound for every time: never below the truth between the times looked at, and hardly above it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anim.gltf.reading import reader
from anim.measure.continuous_bound.prover import BOUND_SLACK, Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.model import Scene, Track
from tests.anim.measure.continuous_bound.making import ALL, apart, between, pair, proven
from tests.anim.skinning.scenes import mesh, scene
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, clip, skeleton, track
from tests.files import opened_path

Asset = Callable[[str], Path]
RADIUS = 2.0  # m, of the one vertex from its joint
POINT = scene(mesh([[RADIUS, 0, 0]], [[0]], [[1.0]]), [-1])
ROUNDING = 1 + 1e-12
ROBOT = pytest.param("Robot.glb", 2, marks=pytest.mark.slow)


@pytest.mark.slow
@given(st.integers(0, 100_000), st.sampled_from(ALL))
@settings(max_examples=5)
def test_nothing_moves_further_at_any_time(seed: int, player: str) -> None:
    _check_bound(seed, player)


@pytest.mark.slow
@given(st.integers(0, 100_000), st.sampled_from(ALL))
@settings(max_examples=60)
def test_nothing_moves_further_in_many_cases(seed: int, player: str) -> None:
    _check_bound(seed, player)


def _check_bound(seed: int, player: str) -> None:
    """Small trees with every interpolation, other keys on both sides, morphs, scales, quaternions off unit length."""
    of, before, after = pair(seed)
    found = proven(of, before, after)
    times = between(dense_times(before, after), 3, seed)
    truth = apart(of, before, after, times, player)
    assert found.bound is None or truth <= found.bound * ROUNDING + 1e-12


@given(st.integers(0, 100_000))
@settings(max_examples=20)
def test_the_bound_is_tight_where_nothing_is_cubic(seed: int) -> None:
    found = proven(*pair(seed, modes=(STEP, LINEAR, LINEAR), wild=(0.02, 0.1)))
    assert found.bound is not None
    assert found.error.max_error <= found.bound <= 1.1 * found.error.max_error + 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("step", [1, 3])
@pytest.mark.parametrize(
    ("name", "number"),
    [("Fox.glb", 1), ("CesiumMan.glb", 0), ("RiggedSimple.gltf", 0), ("InterpolationTest.gltf", 5), ROBOT],
)
def test_real_files(asset: Asset, name: str, number: int, step: int) -> None:
    """Fifty times by chance between each two neighbors, on every vertex, with each player in turn."""
    document = opened_path(asset(name))
    of, before = reader.scene(document), reader.clips(document)[number]
    after = clip(*(_coarser(each, step) for each in before.tracks))
    ruler = ErrorMetric(of, shell=0.01)
    times = dense_times(before, after)
    look = ruler.sample_errors(before, after, times, players=ALL)
    found = Prover(ruler).certified(before, after, times, look)
    assert found.bound is not None
    assert found.error.max_error <= found.bound <= (1 + BOUND_SLACK) * found.error.max_error + 1e-6 * ruler.diagonal
    dense = between(times, 50)
    truth = max(ruler.error_at(before, after, dense, player=player).max_error for player in ALL)
    assert truth <= found.bound * 1.0011 + 1e-12  # a ruler is up to 0.1 % above the truth itself


def _coarser(of: Track, step: int) -> Track:
    """A track with some of its keys only, rotations as int16 holds them."""
    keep = np.unique([*range(0, len(of.times), step), len(of.times) - 1])
    values = np.round(of.values[keep] * 32767) / 32767 if of.path == "rotation" else of.values[keep]
    sides = (None if each is None else each[keep] for each in (of.in_tangents, of.out_tangents))
    arriving, leaving = sides
    return of.with_keys(of.times[keep], values, arriving, leaving)


@pytest.mark.parametrize("turning_first", [True, False])
@pytest.mark.parametrize("degrees", [5, 60, 150])
def test_an_arc_above_its_chord(degrees: float, turning_first: bool) -> None:
    """A point that turns at constant speed, against one that goes straight: r · (1 − cos(θ / 2)), half-way."""
    turn = about("z", [0, degrees])
    end = np.array([np.cos(np.radians(degrees)) - 1, np.sin(np.radians(degrees)), 0]) * RADIUS
    arc = clip(track("rotation", [0, 1], turn))
    chord = clip(track("translation", [0, 1], np.array([np.zeros(3), end])))
    clips = (arc, chord) if turning_first else (chord, arc)
    sagitta = RADIUS * (1 - np.cos(np.radians(degrees) / 2))
    found = proven(POINT, *clips, players=("spec",))
    assert found.bound is not None
    assert sagitta <= found.bound * ROUNDING
    assert found.bound <= sagitta * (1 + BOUND_SLACK)


def test_the_ends_alone_show_nothing_and_the_second_look_shows_all() -> None:
    """Looked at only where both agree: the bound is that of an arc above its chord all the same."""
    turn = about("z", [0, 20])
    end = np.array([np.cos(np.radians(20)) - 1, np.sin(np.radians(20)), 0]) * RADIUS
    arc, chord = clip(track("rotation", [0, 1], turn)), clip(track("translation", [0, 1], np.array([np.zeros(3), end])))
    ruler, times = ErrorMetric(POINT), np.array([0.0, 1.0])
    look = ruler.sample_errors(chord, arc, times)
    assert look.error.max_error < 1e-12
    found = Prover(ruler).certified(chord, arc, times, look)
    sagitta = RADIUS * (1 - np.cos(np.radians(10)))
    assert found.bound is not None
    assert sagitta * (1 - 1e-12) <= found.bound < 1.02 * sagitta
    assert found.error.max_error == pytest.approx(sagitta, rel=1e-3)
    assert found.error.time == pytest.approx(0.5)


def test_the_moment_before_a_jump() -> None:
    """three.js normalizes near keys only: a key that is too long shows on the side of the wide turn, not at the key."""
    keys = about("z", [0, 60, 61])
    long = keys * np.array([[1], [1.001], [1]])
    before, after = (clip(track("rotation", [0, 1, 2], each)) for each in (keys, long))
    ruler = ErrorMetric(POINT)
    times = dense_times(before, after)
    look = ruler.sample_errors(before, after, times, players=("three",))
    found = Prover(ruler).certified(before, after, times, look)
    truth = apart(POINT, before, after, np.array([np.nextafter(1, 0)]), "three")
    assert truth > 1.01 * look.error.max_error
    assert found.bound is not None
    assert truth <= found.bound * ROUNDING
    assert found.error.max_error == pytest.approx(truth, rel=1e-3)
    assert (found.error.time, found.player) == (np.nextafter(1, 0), "three")


def test_the_same_motion_is_certified_as_the_same() -> None:
    """However wildly it moves; cubics too, where they keep away from zero."""
    for seed in range(4):
        of, before, _ = pair(seed, modes=(STEP, LINEAR))
        bound = proven(of, before, before).bound
        assert bound is not None
        assert bound <= 1e-12
    rates = np.array([[0, 0, 0.9, 0], [0, 1.5, 0, 0]])
    cubic = clip(track("rotation", [0, 1], about("z", [0, 120]), CUBICSPLINE, tangents=(rates, rates)))
    assert proven(POINT, cubic, cubic).bound == 0


def test_enough_is_enough() -> None:
    """Where less than 1 % is left below a bound, the second look is as fine as that takes."""
    arc = clip(track("rotation", [0, 1], about("z", [0, 150])))
    end = np.array([np.cos(np.radians(150)) - 1, np.sin(np.radians(150)), 0]) * RADIUS
    chord = clip(track("translation", [0, 1], np.array([np.zeros(3), end])))
    sagitta = RADIUS * (1 - np.cos(np.radians(75)))
    plain, closer = (proven(POINT, chord, arc, players=("spec",), enough=sagitta * by) for by in (2, 1.00005))
    assert plain.bound is not None
    assert closer.bound is not None
    assert closer.bound <= 1.00005 * sagitta < plain.bound


def test_what_can_not_be_proven_is_not() -> None:
    """A cubic through zero has no direction there; another hierarchy has other majorants."""
    keys = np.array([[0, 0, 0, 1.0], [0, 0, 0, -1.0]])
    still = np.zeros((2, 4))
    through = clip(track("rotation", [0, 1], keys, CUBICSPLINE, tangents=(still, still)))
    turning = clip(track("rotation", [0, 1], about("z", [0, 30])))
    assert proven(POINT, turning, through).bound is None
    one, other = (Scene(skeleton([-1, 0, parent]), ()) for parent in (0, 1))
    ruler, times = ErrorMetric(one, other), np.array([0.0, 1.0])
    assert Prover(ruler).certified(turning, turning, times, ruler.sample_errors(turning, turning, times)).bound is None


def test_one_time_is_every_time() -> None:
    a, b = (clip(track("translation", [0], [[x, 0, 0]])) for x in (0.0, 0.5))
    assert proven(POINT, a, b).bound == pytest.approx(0.5)


def test_long_clips_are_gone_through_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    of, before, after = pair(12, modes=(STEP, LINEAR))
    whole = proven(of, before, after)
    monkeypatch.setattr("anim.measure.continuous_bound.prover.BLOCK", 1)
    parts = proven(of, before, after)
    assert whole.bound is not None
    assert parts.bound == pytest.approx(whole.bound, rel=BOUND_SLACK)
    times = between(dense_times(before, after), 3)
    assert parts.bound is not None
    assert max(apart(of, before, after, times, player) for player in ALL) <= parts.bound * ROUNDING
