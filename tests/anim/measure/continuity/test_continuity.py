"""Smoothness at keys, against scipy's splines, central differences, and cases whose grade is known."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.curves.tangents.table import TANGENTS, apply_rotation_tangents, apply_tangents
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.measure.continuity import knots
from anim.measure.continuity.continuity import ContinuityClass, TrackContinuity, at_keys, continuity
from anim.model import AccessorFormat, Track
from anim.sampling import derivatives
from tests import clips
from tests.clips import CUBICSPLINE, STEP, about
from tests.files import opened_path

VALUES = [0, 0.9, 0.2, 1]


def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def stored(values: Floats) -> Floats:
    """Values as a file holds them."""
    return np.asarray(values, np.float32).astype(np.float64)


def along_x(values: list[float]) -> Floats:
    return np.stack((np.array(values, float), np.full(len(values), 3.0), np.zeros(len(values))), axis=1)


def splined(rule: str, values: Floats, path: str = "translation", times: Floats | None = None) -> Track:
    t = np.arange(len(values), dtype=float) if times is None else stored(times)
    make = apply_rotation_tangents if path == "rotation" else apply_tangents
    keys = make(t, values, TANGENTS[rule])
    tangents = stored(keys.in_tangents), stored(keys.out_tangents)
    return clips.track(path, t, stored(keys.values), CUBICSPLINE, tangents=tangents)


def grades(track: Track) -> list[str]:
    return [str(grade) for grade in at_keys(track).grades]


def turns(count: int = 6) -> Floats:
    steps = np.random.default_rng(1).normal(size=(count, 3)) * 0.6
    rotation, result = Rotation.identity(), []
    for step in steps:
        rotation = rotation * Rotation.from_rotvec(step)
        result.append(rotation.as_quat())
    return quaternion.align_signs(np.array(result))


@pytest.mark.parametrize("path", ["translation", "weights"])
def test_the_curves_of_the_book(path: str) -> None:
    values = along_x(VALUES) if path == "translation" else np.array(VALUES)[:, None]
    assert grades(splined("catmull-rom", values, path)) == ["C1", "C1"]
    assert grades(splined("natural", values, path)) == ["C2", "C2"]
    assert grades(clips.track(path, range(4), values)) == ["C0", "C0"]
    assert grades(clips.track(path, range(4), values, STEP)) == ["jump", "jump"]


def test_sizes_by_hand() -> None:
    line = at_keys(clips.track("translation", range(4), along_x(VALUES)))
    np.testing.assert_allclose(line.speed, [1.6, 1.5])
    steps = at_keys(clips.track("translation", range(4), along_x(VALUES), STEP))
    np.testing.assert_allclose(steps.value, [0.9, 0.7])
    # tangents 0.1 at 1 s, 1.7 at 0 s and 0.05 at 2 s: 6·0.9·(−1) + 2·1.7 + 4·0.1 = −1.6, 6·(−0.7) − 4·0.1 − 2·0.05
    rom = at_keys(splined("catmull-rom", along_x(VALUES)))
    np.testing.assert_allclose(rom.acceleration[0], abs(-1.6 - -4.7), rtol=1e-6)
    assert rom.speed.max() < 1e-6


@pytest.mark.parametrize("rule", ["natural", "clamped", "bspline"])
def test_smooth_rules_are_c2_at_any_spacing(rule: str) -> None:
    t = np.cumsum(rng().uniform(0.02, 0.5, 40))
    assert set(grades(splined(rule, rng().normal(size=(40, 3)), times=t))) == {"C2"}


@pytest.mark.parametrize("rule", ["time-aware", "catmull-rom", "monotone", "akima", "flat"])
def test_local_rules_are_c1_at_any_spacing(rule: str) -> None:
    t = np.cumsum(rng().uniform(0.02, 0.5, 40))
    assert set(grades(splined(rule, rng().normal(size=(40, 3)), times=t))) == {"C1"}


def test_centripetal_goes_on_in_direction_only() -> None:
    t, values = np.cumsum(rng().uniform(0.1, 0.5, 12)), rng().normal(size=(12, 3))
    assert set(grades(splined("centripetal", values, times=t))) == {"G1"}
    # weights are numbers without a direction: the same speeds are only continuous
    assert set(grades(splined("centripetal", values, "weights", times=t))) == {"C0"}


def test_rotations() -> None:
    t = np.array([0.3, 0.5, 1.1, 1.4, 2.2, 2.5])
    q = turns()
    assert grades(clips.track("rotation", t, q)) == ["C0"] * 4
    assert grades(clips.track("rotation", t, q, STEP)) == ["jump"] * 4
    assert grades(splined("time-aware", q, "rotation", t)) == ["C1"] * 4
    assert grades(splined("natural", q, "rotation", t)) == ["C2"] * 4
    assert grades(splined("centripetal", q, "rotation", t)) == ["G1"] * 4


def test_slerp_about_one_axis() -> None:
    speeds_up = clips.track("rotation", [0, 1, 2, 3], about("y", [0, 30, 90, 120]))
    found = at_keys(speeds_up)
    assert list(found.grades) == [ContinuityClass.G1, ContinuityClass.G1]
    np.testing.assert_allclose(np.degrees(found.speed), [30, 30])
    assert grades(clips.track("rotation", [0, 1, 2], about("y", [0, 40, 80]))) == ["C2"]
    assert grades(clips.track("rotation", [0, 1, 2], about("y", [0, 40, 0]))) == ["C0"]


def test_signs_of_quaternions_do_not_count() -> None:
    q = about("x", [0, 40, 80, 120])
    q[2] *= -1
    assert grades(clips.track("rotation", range(4), q)) == ["C2", "C2"]
    held = at_keys(clips.track("rotation", range(4), np.stack((q[0], q[1], -q[1], q[3])), STEP))
    assert [str(g) for g in held.grades] == ["jump", "C2"]


def test_jumps_against_scipy_piece_by_piece() -> None:
    random = np.random.default_rng(5)
    t = np.cumsum(random.uniform(0.05, 0.7, 9))
    v, before, after = random.normal(size=(3, 9, 3))
    found = at_keys(clips.track("translation", t, v, CUBICSPLINE, tangents=(before, after)))
    pieces = [CubicHermiteSpline(t[k : k + 2], v[k : k + 2], [after[k], before[k + 1]]) for k in range(8)]
    for k in range(1, 8):
        for order, sizes in ((1, found.speed), (2, found.acceleration)):
            jump = pieces[k](t[k], order) - pieces[k - 1](t[k], order)
            np.testing.assert_allclose(sizes[k - 1], np.linalg.norm(jump), rtol=1e-9)
    assert set(found.grades) == {ContinuityClass.C0}


def test_scipys_natural_spline_has_no_jumps() -> None:
    t = np.array([0, 0.3, 1, 1.2, 2])
    v = rng().normal(size=(5, 3))
    rates = CubicSpline(t, v, bc_type="natural")(t, 1)
    found = at_keys(clips.track("translation", t, v, CUBICSPLINE, tangents=(rates, rates)))
    assert found.acceleration.max() < 1e-9 * np.abs(rates).max() / 0.2


def test_angular_acceleration_against_central_differences() -> None:
    t, q = np.array([0.0, 0.4, 1.0]), turns(3)
    before, after = rng().normal(size=(2, 3, 4)) + 0.3 * q  # tangents that change the length too
    track = clips.track("rotation", t, q, CUBICSPLINE, tangents=(before, after))

    def turn(k: int, at: float) -> Rotation:
        curve = CubicHermiteSpline(t[k : k + 2], q[k : k + 2], [after[k], before[k + 1]])
        return Rotation.from_quat(curve(at))

    def rate(k: int, at: float, step: float = 1e-5) -> Floats:
        """Body rates: R⁻¹(t) seen from both sides."""
        return np.asarray((turn(k, at - step).inv() * turn(k, at + step)).as_rotvec() / (2 * step))

    for k, at in ((0, 0.1), (0, 0.33), (1, 0.5), (1, 0.9)):
        expected = (rate(k, at + 1e-3) - rate(k, at - 1e-3)) / 2e-3
        found = knots.accelerations(track, np.array([at]), before=False)[0]
        np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-3 * np.abs(expected).max())


def test_rms_against_dense_samples() -> None:
    track = splined("time-aware", rng().normal(size=(7, 3)), times=np.array([0, 0.2, 0.9, 1, 1.7, 2, 3.0]))
    fine = np.linspace(0, 3, 300_001)[1:] - 5e-6
    pulled = knots.accelerations(track, fine, before=False)
    speed, acceleration = knots.root_mean_squares(track)
    np.testing.assert_allclose(acceleration, np.sqrt((pulled**2).sum(axis=1).mean()), rtol=1e-4)
    moved = derivatives.rates(track, fine, before=False)
    np.testing.assert_allclose(speed, np.sqrt((moved**2).sum(axis=1).mean()), rtol=1e-4)


def test_two_keys_one_float_apart_are_a_jump() -> None:
    early = float(np.nextafter(np.float32(1), np.float32(0)))
    t = [0, early, 1, 2]
    v = np.array([[0.0], [0.5], [0.8], [1.0]])
    found = at_keys(clips.track("weights", t, v))
    assert list(found.grades) == [ContinuityClass.JUMP]
    np.testing.assert_allclose(found.value, [0.3])
    np.testing.assert_allclose(found.times, [1])
    np.testing.assert_allclose(found.speed, [0.3], rtol=1e-5)
    same = at_keys(clips.track("weights", t, np.array([[0.0], [0.5], [0.5], [1.0]])))
    assert list(same.grades) == [ContinuityClass.C2]


def test_a_jump_at_the_start_counts_though_it_is_no_inner_key() -> None:
    found = at_keys(clips.track("weights", [0, 1e-6, 1], [[0.0], [0.4], [1.0]]))
    assert list(found.grades) == [ContinuityClass.JUMP]
    np.testing.assert_allclose(found.value, [0.4])


@pytest.mark.parametrize("offset", [0.0, 10.0, 1000.0])
def test_even_motion_at_a_frame_rate_is_smooth_in_float32(offset: float) -> None:
    t = stored(np.arange(1, 200) / 60)
    v = stored(offset + t[:, None] * np.array([0.3, -0.1, 0.02]))
    assert set(grades(clips.track("translation", t, v))) == {"C2"}


def test_even_turns_in_normalized_shorts_are_smooth() -> None:
    t = stored(np.arange(100) / 30)
    q = np.rint(about("z", np.linspace(0, 170, 100)) * 32767) / 32767
    track = clips.track("rotation", t, q, storage=AccessorFormat(5122, normalized=True))
    assert set(grades(track)) == {"C2"}
    bend = np.concatenate((np.linspace(0, 60, 50), np.linspace(60, 0, 51)[1:]))
    bent = clips.track("rotation", t, about("z", bend), storage=AccessorFormat(5122, normalized=True))
    assert grades(bent).count("C0") == 1


def test_still_tracks() -> None:
    found = one(clips.track("translation", [0, 1, 2], [[1, 2, 3]] * 3))
    assert found.still
    assert found.seam is None
    assert (found.interior_keys, found.c2) == (1, 1)
    assert one(clips.track("translation", [0], [[1, 2, 3]])).interior_keys == 0


@pytest.mark.parametrize(
    ("name", "clip", "allowed"),
    [
        ("Fox.glb", 1, {"c0", "g1", "c2"}),
        ("CesiumMan.glb", 0, {"c0", "g1", "c2"}),
        ("BitmojiRun.glb", 0, {"c0", "g1", "c2"}),
        ("InterpolationTest.gltf", 0, {"jumps"}),
        ("InterpolationTest.gltf", 2, {"c1"}),
        ("InterpolationTest.gltf", 5, {"g1"}),
        ("CubicMorph/01_cs_morph.gltf", 0, {"c2"}),
    ],
)
def test_real_files(asset: Callable[[str], Path], name: str, clip: int, allowed: set[str]) -> None:
    document = opened_path(asset(name))
    chosen = reader.clips(document)[clip]
    counts = dict.fromkeys(("jumps", "c0", "g1", "c1", "c2"), 0)
    for track, found in zip(chosen.tracks, continuity(chosen, reader.skeleton(document)), strict=True):
        of_track = {grade: getattr(found, grade) for grade in counts}
        assert sum(of_track.values()) == found.interior_keys == max(len(track.times) - 2, 0)
        counts = {grade: counts[grade] + of_track[grade] for grade in counts}
    assert {grade for grade, count in counts.items() if count} == allowed


def test_the_summary_names_the_largest_jump() -> None:
    found = one(clips.track("translation", range(4), along_x(VALUES)))
    assert found.target == "0"
    assert found.unit == "m"
    assert found.largest_value_jump is None
    assert found.largest_speed_jump is not None
    assert found.largest_speed_jump.time_s == 1
    assert found.largest_speed_jump.size == pytest.approx(1.6)
    assert found.largest_acceleration_jump is None


def one(track: Track) -> TrackContinuity:
    return continuity(clips.clip(track), clips.skeleton([-1]))[0]
