"""Eased clips, written to a file and read again, against formulas written plainly: at 1000 times a piece."""

from __future__ import annotations

import importlib
import math
from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.curves.easing.table import EASINGS, parse
from anim.errors import RangeError
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track
from anim.operations.ease import Tolerances, ease
from anim.sampling.track import sample
from tests import clips
from tests.anim.operations.plain_eases import EASES, Ease, elastic_out
from tests.calls import count_calls
from tests.clips import CUBICSPLINE, STEP
from tests.files import mark_slow

KEYS = np.array([0.0, 0.5, 1.25, 3.0])
VALUES = np.array([[0.0, 1, 0], [2, -1, 0.5], [2.5, 3, 0], [-1, 0, 4]])
TURNS = quaternion.normalize(
    np.array([[0.1, 0.2, -0.3, 0.9], [0.5, 0.5, 0.5, 0.5], [0, 0.9, 0.1, 0.2], [1, 0, 0, 0.3]])
)
INSIDE = (np.arange(1000) + 0.5) / 1000
MOVE = clips.track("translation", KEYS, VALUES)
TURN = clips.track("rotation", KEYS, TURNS)
ANGLE = math.radians(0.05)


def stored(track: Track) -> Track:
    """The track as a file holds it: every number rounded to float32."""
    parts = (track.times, track.values, track.in_tangents, track.out_tangents)
    times, values, before, after = (None if p is None else p.astype(np.float32).astype(np.float64) for p in parts)
    assert times is not None
    assert values is not None
    return Track(track.node, track.path, track.interpolation, times, values, before, after)


def eased(track: Track, name: str, **options: object) -> Track:
    return stored(ease(Clip("", (track,)), easing=parse(name), **options).tracks[0])  # type: ignore[arg-type]


def off(track: Track, new: Track, plain: Ease) -> float:
    """The largest error as a share of each piece's range, or in radians."""
    shares = np.array([plain(u) for u in INSIDE.tolist()])
    worst = 0.0
    for k in range(len(track.times) - 1):
        got = sample(new, track.times[k] + (track.times[k + 1] - track.times[k]) * INSIDE)
        if track.path == "rotation":
            true = _slerped(track.values[k], track.values[k + 1], shares)
            worst = max(worst, float(quaternion.angle_between(got, true).max()))
        else:
            way = track.values[k + 1] - track.values[k]
            worst = max(worst, float(np.abs(got - track.values[k] - shares[:, None] * way).max() / np.abs(way).max()))
    return worst


def _slerped(a: Floats, b: Floats, shares: Floats) -> Floats:
    """By the definition: the part of the turn about its axis, by a rotation matrix's exponential in scipy."""
    from scipy.spatial.transform import Rotation

    first, last = Rotation.from_quat(a), Rotation.from_quat(b)
    turn = (first.inv() * last).as_rotvec()
    return np.asarray((first * Rotation.from_rotvec(shares[:, None] * turn)).as_quat())


@pytest.mark.parametrize("name", EASES)
def test_vectors_follow_within_tolerance(name: str) -> None:
    new = eased(MOVE, name)
    exact = parse(name).exact is not None
    assert off(MOVE, new, EASES[name]) <= (1e-6 if exact else 1e-3)
    assert new.interpolation is CUBICSPLINE


SLOW = ("cubic-bezier(.2, 0, 0, 1)", "ease-in", "ease-out", "ease-in-out")  # as `ease` is, which stays


@pytest.mark.parametrize("name", mark_slow(EASES, SLOW))
def test_rotations_follow_within_tolerance(name: str) -> None:
    assert off(TURN, eased(TURN, name), EASES[name]) <= ANGLE * 1.001


@pytest.mark.parametrize("name", ["smoothstep", "expo-out", "back-in", "ease", "bounce-out"])
@pytest.mark.parametrize("track", [MOVE, TURN], ids=["translation", "rotation"])
def test_linear_output_follows_too(name: str, track: Track) -> None:
    new = eased(track, name, interpolation="linear")
    assert new.interpolation is Interpolation.LINEAR
    assert off(track, new, EASES[name]) <= (ANGLE if track.path == "rotation" else 1e-3) * 1.001


@pytest.mark.parametrize("name", ["smoothstep", "quad-in", "back-out", "hermite(2, 0)"])
def test_one_cubic_is_one_piece(name: str) -> None:
    assert len(eased(MOVE, name).times) == len(KEYS)


def test_quad_in_by_hand() -> None:
    new = eased(clips.track("translation", [0, 2], [[0, 0, 0], [4, 0, 0]]), "quad-in")
    assert new.in_tangents is not None
    np.testing.assert_allclose(new.in_tangents[:, 0], [0, 4])  # 2 · 4 m / 2 s
    assert not np.asarray(new.out_tangents).any()


def test_smooth_quarter_turn_takes_three_pieces() -> None:
    quarter = clips.track("rotation", [0, 1], clips.about("y", [0, 90]))
    new = eased(quarter, "smoothstep", tolerances=Tolerances(angle=math.radians(0.1)))
    assert len(new.times) - 1 <= 3


def test_elastic_swings_as_published() -> None:
    assert off(MOVE, eased(MOVE, "elastic-out"), elastic_out) <= 2e-3


def test_keys_keep_their_values() -> None:
    for name in ("elastic-out", "spring(100, 10)", "bounce-in-out"):
        new = eased(MOVE, name)
        np.testing.assert_allclose(sample(new, KEYS), VALUES, atol=1e-6)


def test_spline_sources_keep_their_path() -> None:
    tangents = (np.ones((4, 3)), -np.ones((4, 3)))
    curve = clips.track("translation", KEYS, VALUES, CUBICSPLINE, tangents=tangents)
    new = eased(curve, "smoothstep")
    u = INSIDE
    for k in range(3):
        span = KEYS[k + 1] - KEYS[k]
        true = sample(curve, KEYS[k] + span * (u * u * (3 - 2 * u)))
        np.testing.assert_allclose(sample(new, KEYS[k] + span * u), true, atol=2e-3)


@pytest.mark.parametrize("path", ["translation", "rotation"])
def test_spline_sources_keep_to_the_tolerance_beyond_their_keys(path: str) -> None:
    """Extrapolated by a spring, they are faster than between keys; a quaternion's components come near to 0 there."""
    from scipy.interpolate import CubicHermiteSpline

    values = VALUES[:2] if path == "translation" else np.array([[0.9, 0, 0.1, 0.42], [-0.2, 0.3, 0.1, 0.9]])
    slopes = np.array([[1.0, 0, 3, 0], [-2, 0.5, 7, -1]])[:, : values.shape[1]]
    spline = CubicHermiteSpline([0, 1], values, slopes, extrapolate=True)
    source = Track(0, path, CUBICSPLINE, np.array([0.0, 1]), values, slopes, slopes)
    new = eased(source, "spring(100, 2)", interpolation="linear")
    times = (np.arange(20000) + 0.5) / 20000
    got, true = sample(new, times), spline(parse("spring(100, 2)").value(times))
    if path == "rotation":
        assert quaternion.angle_between(got, quaternion.normalize(true)).max() <= ANGLE
    else:
        assert np.abs(got - true).max() <= 1e-3 * np.abs(values[1] - values[0]).max()


@pytest.mark.parametrize("count", [1, 3])
def test_steps_become_step(count: int) -> None:
    new = eased(MOVE, f"steps({count})")
    assert new.interpolation is STEP
    level = np.floor(INSIDE * count) / count
    for k in range(3):
        got = sample(new, KEYS[k] + (KEYS[k + 1] - KEYS[k]) * INSIDE)
        np.testing.assert_allclose(got, VALUES[k] + level[:, None] * (VALUES[k + 1] - VALUES[k]), atol=1e-6)
    np.testing.assert_allclose(new.values[-1], VALUES[-1])


def test_part_of_a_track_is_eased_and_the_rest_stays_straight() -> None:
    new = eased(MOVE, "smoothstep", start=0.5, end=1.25)
    straight = np.concatenate((np.linspace(0, 0.5, 50), np.linspace(1.25, 3, 50)))
    np.testing.assert_allclose(sample(new, straight), sample(MOVE, straight), atol=1e-5)
    middle = VALUES[1] + 0.15625 * (VALUES[2] - VALUES[1])  # smoothstep(¼)
    np.testing.assert_allclose(sample(new, np.array([0.5 + 0.75 / 4]))[0], middle, atol=1e-5)


def test_steps_in_a_part_jump_within_a_microsecond_or_so() -> None:
    new = eased(MOVE, "steps(2)", start=0.5, end=1.25)
    assert new.interpolation is CUBICSPLINE
    near = np.array([0.5, 0.874, 0.876, 1.249, 1.2501])
    middle = (VALUES[1] + VALUES[2]) / 2
    want = [VALUES[1], VALUES[1], middle, middle, sample(MOVE, near[-1:])[0]]
    np.testing.assert_allclose(sample(new, near), want, atol=1e-3)


def test_steps_at_the_end_of_a_late_track_jump_within_float32() -> None:
    """At 7200 s float32 times are 0.5 ms apart: the jump to the last key takes two of those."""
    late = clips.track("translation", 7200 + 20 * KEYS, VALUES)
    new = eased(late, "steps(2)", start=7210.0)
    near = 7200 + np.array([10.1, 59.99, 60.0])
    np.testing.assert_allclose(sample(new, near), [VALUES[1], (VALUES[2] + VALUES[3]) / 2, VALUES[3]], atol=1e-3)


def test_holds_and_single_keys_stay() -> None:
    held = clips.track("scale", [0, 1], [[1, 1, 1], [2, 2, 2]], STEP)
    single = clips.track("scale", [0], [[1, 1, 1]], node=1)
    before = Clip("", (held, single))
    assert ease(before, easing=EASINGS["quad-in"]).tracks == before.tracks


def test_tracks_not_chosen_stay() -> None:
    before = Clip("", (MOVE, TURN))
    after = ease(before, easing=EASINGS["quad-in"], tracks=frozenset({1}))
    assert after.tracks[0] is MOVE
    assert after.tracks[1] is not TURN


def test_unknown_output_is_refused() -> None:
    with pytest.raises(RangeError, match="interpolation"):
        ease(Clip("", ()), easing=EASINGS["linear"], interpolation="step")


def test_fewest_pieces_of_a_hard_ease() -> None:
    limits = {"sine-in-out": 4, "smootherstep": 6, "quart-in": 3, "expo-out": 8, "elastic-out": 25, "ease": 8}
    one = clips.track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    counts = {name: len(eased(one, name).times) - 1 for name in limits}
    assert all(counts[name] <= limits[name] for name in limits), counts


def test_long_tracks_that_share_keys_are_eased_once(monkeypatch: pytest.MonkeyPatch) -> None:
    times, values = np.arange(5000) / 30, np.random.default_rng(3).normal(size=(5000, 3))
    one, other = (Track(0, "translation", "LINEAR", times, each) for each in (values, values + 1))
    counted = count_calls(monkeypatch, importlib.import_module("anim.operations.ease"), "ease_segments")
    found = ease(Clip("", (one, one.on_node(1), replace(other, node=2))), easing="ease-in").tracks
    assert len(counted) == 2
    assert found[1].values is found[0].values
    assert found[1] == replace(ease(Clip("", (one,)), easing="ease-in").tracks[0], node=1)
    assert found[2] == replace(ease(Clip("", (other,)), easing="ease-in").tracks[0], node=2)
