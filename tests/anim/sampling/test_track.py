"""Values between keys: against scipy, and against glTF's formulas written out one number at a time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

from anim.gltf.reading import reader
from anim.model import Interpolation, Track, ValueKind
from anim.sampling import track as sampling_track
from anim.sampling.lazy_batch import batches
from anim.sampling.track import find_interval, sample
from tests.clips import CUBICSPLINE, STEP, about, track
from tests.files import opened_fixture

RNG = np.random.default_rng(11)
TIMES = np.array([0.25, 0.5, 1.25, 1.5, 4.0])  # s, uneven
AT = np.sort(np.concatenate((np.linspace(0, 5, 301), TIMES)))
INSIDE = AT[np.clip(AT, TIMES[0], TIMES[-1]) == AT]
QUATERNIONS = RNG.normal(size=(5, 4))
QUATERNIONS /= np.linalg.norm(QUATERNIONS, axis=1, keepdims=True)
VECTORS, ARRIVING, LEAVING = RNG.normal(size=(3, 5, 3))
TURNING_IN, TURNING_OUT = RNG.normal(size=(2, 5, 4))

TRACKS = {
    "step vectors": track("translation", TIMES, VECTORS, STEP),
    "step rotations": track("rotation", TIMES, QUATERNIONS, STEP),
    "linear vectors": track("translation", TIMES, VECTORS),
    "linear rotations": track("rotation", TIMES, QUATERNIONS),
    "cubic vectors": track("translation", TIMES, VECTORS, CUBICSPLINE, tangents=(ARRIVING, LEAVING)),
    "cubic rotations": track("rotation", TIMES, QUATERNIONS, CUBICSPLINE, tangents=(TURNING_IN, TURNING_OUT)),
    "one key": track("translation", [1.0], [[1, 2, 3]]),
    "one turn": track("rotation", [1.0], [[0.6, 0, 0, 0.8]], STEP),
    "a pointer's turn": track("/extensions/EXT_lights_image_based/lights/0/rotation", TIMES, QUATERNIONS),
    "weights": track("weights", TIMES, VECTORS),
}


@pytest.mark.parametrize("name", TRACKS)
def test_the_formulas_of_the_specification(name: str) -> None:
    """Appendix C, one number at a time."""
    ours = sample(TRACKS[name], AT)
    for t, found in zip(AT.tolist(), ours.tolist(), strict=True):
        assert found == pytest.approx(_plain(TRACKS[name], t), abs=1e-13)


def test_linear_rotations_are_scipys_slerp() -> None:
    theirs = Slerp(TIMES, Rotation.from_quat(QUATERNIONS))(INSIDE).as_quat()
    ours = sample(TRACKS["linear rotations"], INSIDE)
    signs = np.sign((ours * theirs).sum(axis=1, keepdims=True))
    np.testing.assert_allclose(ours, theirs * signs, atol=1e-14)


def test_splines_are_scipys_hermite_pieces() -> None:
    """Tangents may differ on the two sides of a key, so each piece is a spline of its own."""
    for name, values, arriving, leaving in (
        ("cubic vectors", VECTORS, ARRIVING, LEAVING),
        ("cubic rotations", QUATERNIONS, TURNING_IN, TURNING_OUT),
    ):
        for k in range(4):
            at = np.linspace(TIMES[k], TIMES[k + 1], 21)
            theirs = CubicHermiteSpline(TIMES[k : k + 2], values[k : k + 2], [leaving[k], arriving[k + 1]])(at)
            if name == "cubic rotations":
                theirs /= np.linalg.norm(theirs, axis=1, keepdims=True)
            np.testing.assert_allclose(sample(TRACKS[name], at), theirs, atol=1e-12)


@pytest.mark.parametrize("name", TRACKS)
def test_keys_are_exact(name: str) -> None:
    """Rotations as exactly as their unit length can be told."""
    found = sample(TRACKS[name], TRACKS[name].times)
    if TRACKS[name].kind is ValueKind.ROTATION:
        np.testing.assert_allclose(found, TRACKS[name].values, atol=3e-16)
    else:
        np.testing.assert_array_equal(found, TRACKS[name].values)


@pytest.mark.parametrize("name", TRACKS)
def test_a_key_has_the_same_bits_alone_as_between_other_times(name: str) -> None:
    """Times that are all keys take a shorter way."""
    times = TRACKS[name].times
    among = sample(TRACKS[name], np.append(times, times[0] + 0.1))
    np.testing.assert_array_equal(sample(TRACKS[name], times), among[:-1])


@pytest.mark.parametrize("name", TRACKS)
def test_outside_the_keys_the_ends_hold(name: str) -> None:
    first, last = TRACKS[name].times[[0, -1]]
    ends = sample(TRACKS[name], np.array([first, last]))
    before = sample(TRACKS[name], np.array([-1e9, 0, np.nextafter(first, -1)]))
    after = sample(TRACKS[name], np.array([np.nextafter(last, 99), 99, 1e9]))
    np.testing.assert_array_equal(before, np.tile(ends[0], (3, 1)))
    np.testing.assert_array_equal(after, np.tile(ends[1], (3, 1)))


@pytest.mark.parametrize("name", [name for name in TRACKS if TRACKS[name].kind is ValueKind.ROTATION])
def test_rotations_are_unit(name: str) -> None:
    np.testing.assert_allclose(np.linalg.norm(sample(TRACKS[name], AT), axis=1), 1, atol=1e-15)


def test_step_holds_until_the_next_key_to_the_last_bit() -> None:
    jump = track("weights", [0, 1], [[3], [7]], STEP)
    assert sample(jump, np.array([np.nextafter(1, 0), 1.0])).tolist() == [[3], [7]]


def test_linear_by_hand() -> None:
    line = track("weights", [1, 3], [[10], [20]])
    assert sample(line, np.array([0, 1, 1.5, 2, 3, 4])).tolist() == [[10], [10], [12.5], [15], [20], [20]]


def test_the_shorter_way_round_is_taken() -> None:
    turn = track("rotation", [0, 1], [about("y", 0), -about("y", 90)])
    np.testing.assert_allclose(sample(turn, np.array([0.5])), [about("y", 45)], atol=1e-15)


def test_a_cubic_takes_no_shorter_way() -> None:
    """The writer keeps the signs; the reader blends what it finds."""
    zero = np.zeros((2, 4))
    turn = track("rotation", [0, 1], [about("y", 0), -about("y", 90)], CUBICSPLINE, tangents=(zero, zero))
    (middle,) = sample(turn, np.array([0.5]))
    blend = (about("y", 0) - about("y", 90)) / 2
    np.testing.assert_allclose(middle, blend / np.linalg.norm(blend), atol=1e-15)


def test_tangents_are_per_second() -> None:
    """A straight line of slope 3 per second over 4 seconds."""
    slope = [[3], [3]]
    line = track("weights", [1, 5], [[0], [12]], CUBICSPLINE, tangents=(slope, slope))
    np.testing.assert_allclose(sample(line, np.array([2.0, 3.0, 4.5]))[:, 0], [3, 6, 10.5], rtol=1e-15)


def test_a_half_turn_has_a_way() -> None:
    half = track("rotation", [0, 1], [about("y", 0), about("y", 180)])
    np.testing.assert_allclose(sample(half, np.array([0.5])), [about("y", 90)], atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 1e-4])
def test_small_turns_stay_at_constant_speed(angle: float) -> None:
    turn = track("rotation", [0, 1], [about("x", 0), about("x", angle)])
    np.testing.assert_allclose(sample(turn, np.array([0.25])), [about("x", angle / 4)], rtol=1e-12, atol=1e-20)


@given(st.sets(st.floats(0, 1e4, width=32), min_size=1, max_size=6), st.lists(st.floats(-10, 2e4), max_size=6))
def test_locate_is_a_plain_search(keys: set[float], at: list[float]) -> None:
    times = sorted(keys)
    place = find_interval(np.array(times), np.array(at))
    for i, t in enumerate(at):
        left = max((k for k in range(len(times)) if times[k] <= t), default=0)
        right = min(left + 1, len(times) - 1)
        inside = times[left] < t and right > left
        assert (place.left[i], place.right[i]) == (left, right)
        assert place.u[i] == ((t - times[left]) / (times[right] - times[left]) if inside else 0)
        assert place.duration[i] == times[right] - times[left]


def test_batches_give_what_tracks_give() -> None:
    for name in ("interpolations", "biped", "morph_cube", "pointer", "accessors"):
        for clip in reader.clips(opened_fixture(name)):
            grouped = batches(clip.tracks)
            assert [t for t in clip.tracks if t in [x for b in grouped for x in b.tracks]] == list(clip.tracks)
            for batch in grouped:
                for i, each in enumerate(batch.tracks):
                    np.testing.assert_array_equal(batch.sample(AT)[:, i], sample(each, AT))


def _plain(made: Track, t: float) -> list[float]:
    """The value of a track at one time."""
    times = made.times.tolist()
    if t <= times[0]:
        return _unit(made, made.values[0].tolist())
    if t >= times[-1]:
        return _unit(made, made.values[-1].tolist())
    k = max(k for k in range(len(times)) if times[k] <= t)
    a, b, duration = made.values[k].tolist(), made.values[k + 1].tolist(), times[k + 1] - times[k]
    u = (t - times[k]) / duration
    if made.interpolation is Interpolation.STEP:
        return _unit(made, a)
    if made.interpolation is Interpolation.LINEAR:
        return (
            _slerp(a, b, u)
            if made.kind is ValueKind.ROTATION
            else [(1 - u) * x + u * y for x, y in zip(a, b, strict=True)]
        )
    assert made.in_tangents is not None
    assert made.out_tangents is not None
    out, into = made.out_tangents[k].tolist(), made.in_tangents[k + 1].tolist()
    basis = (2 * u**3 - 3 * u**2 + 1, duration * (u**3 - 2 * u**2 + u), 3 * u**2 - 2 * u**3, duration * (u**3 - u**2))
    return _unit(
        made, [sum(w * x for w, x in zip(basis, each, strict=True)) for each in zip(a, out, b, into, strict=True)]
    )


def _slerp(a: list[float], b: list[float], u: float) -> list[float]:
    d = sum(x * y for x, y in zip(a, b, strict=True))
    angle = math.acos(min(abs(d), 1))
    if math.sin(angle) == 0:
        return a
    first, second = math.sin(angle * (1 - u)) / math.sin(angle), math.copysign(math.sin(angle * u) / math.sin(angle), d)
    return [first * x + second * y for x, y in zip(a, b, strict=True)]


def _unit(made: Track, value: list[float]) -> list[float]:
    if made.kind is not ValueKind.ROTATION:
        return value
    length = math.sqrt(sum(x * x for x in value))
    return [x / length for x in value]


@pytest.mark.parametrize("keyed", TRACKS.values(), ids=TRACKS)
def test_many_times_are_mixed_in_blocks(keyed: Track, monkeypatch: pytest.MonkeyPatch) -> None:
    for at in (AT[::60], AT):
        whole = sample(keyed, at)
        with monkeypatch.context() as patch:
            patch.setattr(sampling_track, "MAX_MIXED_VALUES", 33)
            np.testing.assert_array_equal(sample(keyed, at), whole)
