"""Tangent rules against scipy's splines, against one-sided differences of the written cubic, and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import Akima1DInterpolator, BSpline, CubicHermiteSpline, CubicSpline, PchipInterpolator

from anim.arrays import Floats
from anim.curves.tangents.rule import SplineKeys
from anim.curves.tangents.table import TANGENT_FACTORIES, TANGENTS, apply_rotation_tangents, apply_tangents, parse
from anim.errors import RangeError, ShapeError
from tests.anim.curves.tangents.splines import C1, EVERY, TIMES, TURNS, VALUES, piece

LOOP = np.concatenate((VALUES[:-1], VALUES[:1]))
SMOOTH = ["natural", "clamped", "periodic", "bspline"]


def jump(times: Floats, keys: SplineKeys, k: int, order: int) -> float:
    """Return how far the derivative of an order jumps at key k."""
    right = (
        piece(times, keys, k, np.zeros(1), order) if k < len(times) - 1 else piece(times, keys, 0, np.zeros(1), order)
    )
    return float(np.abs(right - piece(times, keys, k - 1, np.ones(1), order)).max())


@pytest.mark.parametrize(
    ("name", "spline"),
    [
        ("natural", CubicSpline(TIMES, VALUES, bc_type="natural")),
        ("clamped", CubicSpline(TIMES, VALUES, bc_type="clamped")),
        ("monotone", PchipInterpolator(TIMES, VALUES)),
        ("akima", Akima1DInterpolator(TIMES, VALUES)),
    ],
)
def test_curve_is_that_of_scipy(name: str, spline: CubicSpline) -> None:
    keys = apply_tangents(TIMES, VALUES, TANGENTS[name])
    t = np.linspace(TIMES[0], TIMES[-1], 300)
    own = CubicHermiteSpline(TIMES, keys.values, np.concatenate((keys.out_tangents[:-1], keys.in_tangents[-1:])))
    np.testing.assert_allclose(own(t), spline(t), atol=1e-12)


def test_periodic_is_that_of_scipy() -> None:
    keys = apply_tangents(TIMES, LOOP, TANGENTS["periodic"])
    expected = CubicSpline(TIMES, LOOP, bc_type="periodic")(TIMES, 1)
    np.testing.assert_allclose(keys.out_tangents[:-1], expected[:-1], atol=1e-12)
    np.testing.assert_allclose(keys.in_tangents[1:], expected[1:], atol=1e-12)


@pytest.mark.parametrize("name", C1)
def test_speed_is_continuous(name: str) -> None:
    keys = apply_tangents(TIMES, LOOP, parse(name))
    assert max(jump(TIMES, keys, k, 0) for k in range(1, 8)) < 1e-12
    assert max(jump(TIMES, keys, k, 1) for k in range(1, 8)) < 1e-12


@pytest.mark.parametrize("name", SMOOTH)
def test_acceleration_is_continuous(name: str) -> None:
    keys = apply_tangents(TIMES, LOOP, parse(name))
    assert max(jump(TIMES, keys, k, 2) for k in range(1, 8)) < 1e-11


def test_local_rules_are_not_c2() -> None:
    keys = apply_tangents(TIMES, VALUES, TANGENTS["catmull-rom"])
    assert min(jump(TIMES, keys, k, 2) for k in range(1, 8)) > 0.1


@pytest.mark.parametrize("name", EVERY)
def test_loop_has_no_seam(name: str) -> None:
    keys = apply_tangents(TIMES, LOOP, parse(name), cyclic=True)
    assert jump(TIMES, keys, 8, 0) < 1e-12
    if name in C1:
        assert jump(TIMES, keys, 8, 1) < 1e-12
    if name in ("natural", "periodic", "bspline"):
        assert jump(TIMES, keys, 8, 2) < 1e-11


@pytest.mark.parametrize("name", [name for name in EVERY if name != "clamped"])
def test_loop_does_not_know_where_it_starts(name: str) -> None:
    """Starting the lap two keys later gives the same tangents; only clamped rests where the lap starts."""
    times = np.append(TIMES[2:], TIMES[1:3] + TIMES[-1] - TIMES[0])
    values = np.concatenate((LOOP[2:], LOOP[1:3]))
    one, other = (apply_tangents(t, v, parse(name), cyclic=True) for t, v in ((TIMES, LOOP), (times, values)))
    np.testing.assert_allclose(one.out_tangents[2:8], other.out_tangents[:6], atol=1e-11)
    np.testing.assert_allclose(one.values[2:8], other.values[:6], atol=1e-12)


@pytest.mark.parametrize(
    "name", [n for n in EVERY if n not in ("flat", "clamped", "centripetal", "cardinal(0.5)", "tcb(0.2, 0, -0.3)")]
)
@pytest.mark.parametrize("cyclic", [False, True])
def test_constant_speed_stays(name: str, cyclic: bool) -> None:
    line = TIMES[:, None] * np.array([2.0, -1.0])
    keys = apply_tangents(TIMES, line, parse(name), cyclic=cyclic)
    np.testing.assert_allclose(keys.values, line, atol=1e-12)
    np.testing.assert_allclose(keys.out_tangents[:-1], np.tile([2.0, -1.0], (8, 1)), atol=1e-11)
    np.testing.assert_allclose(keys.in_tangents[1:], np.tile([2.0, -1.0], (8, 1)), atol=1e-11)


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("cyclic", [False, True])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_keys(name: str, cyclic: bool, count: int) -> None:
    keys = apply_tangents(TIMES[:count], VALUES[:count], parse(name), cyclic=cyclic)
    assert keys.values.shape == keys.in_tangents.shape == keys.out_tangents.shape == (count, 3)
    assert np.isfinite((keys.values, keys.in_tangents, keys.out_tangents)).all()
    assert not keys.in_tangents[0].any()
    assert not keys.out_tangents[-1].any()
    turned = apply_rotation_tangents(
        TIMES[:count], TURNS[[[0], [0, 0], [0, 1, 0]][count - 1]], parse(name), cyclic=cyclic
    )
    assert np.isfinite((turned.values, turned.in_tangents, turned.out_tangents)).all()


def test_time_aware_by_hand() -> None:
    keys = apply_tangents([0, 1, 3], [[0], [1], [9]], TANGENTS["time-aware"])
    np.testing.assert_array_equal(keys.out_tangents, [[0], [2], [0]])
    np.testing.assert_array_equal(keys.in_tangents, [[0], [2], [6]])


def test_catmull_rom_overshoots() -> None:
    """The lesson's keys: uniform Catmull-Rom through 0, 0.9, 0.2, 1 goes above 0.9; monotone does not."""
    times, values = np.arange(4.0), np.array([[0.0], [0.9], [0.2], [1.0]])
    keys = apply_tangents(times, values, TANGENTS["catmull-rom"])
    np.testing.assert_allclose(keys.out_tangents[1:3], [[0.1], [0.05]], atol=1e-15)
    assert piece(times, keys, 1, np.linspace(0, 1, 200)).max() > 0.901
    steady = apply_tangents(times, values, TANGENTS["monotone"])
    assert max(piece(times, steady, k, np.linspace(0, 1, 200)).max() for k in range(3)) <= 1.0
    assert piece(times, steady, 1, np.linspace(0, 1, 200)).max() <= 0.9


def test_families_meet() -> None:
    def tangents(name: str) -> Floats:
        keys = apply_tangents(TIMES, VALUES, parse(name))
        return np.stack((keys.in_tangents, keys.out_tangents))

    np.testing.assert_allclose(tangents("tcb(0, 0, 0)"), tangents("catmull-rom"), atol=1e-14)
    np.testing.assert_allclose(tangents("cardinal(0)"), tangents("catmull-rom"), atol=1e-14)
    np.testing.assert_allclose(tangents("cardinal(1)"), tangents("flat"), atol=1e-14)
    np.testing.assert_allclose(tangents("tcb(0.4, 0, 0)"), tangents("cardinal(0.4)"), atol=1e-14)


def test_tcb_is_the_published_formula() -> None:
    """With even spacing h: DD = ½(1−t)[(1+c)(1+b)(P−P₋) + (1−c)(1−b)(P₊−P)] per u, DS with c negated."""
    t, c, b, h = 0.3, -0.4, 0.6, 0.5
    keys = apply_tangents(np.arange(3) * h, VALUES[:3], parse(f"tcb({t}, {c}, {b})"))
    left, right = VALUES[1] - VALUES[0], VALUES[2] - VALUES[1]
    after = (1 - t) / 2 * ((1 + c) * (1 + b) * left + (1 - c) * (1 - b) * right) / h
    before = (1 - t) / 2 * ((1 - c) * (1 + b) * left + (1 + c) * (1 - b) * right) / h
    np.testing.assert_allclose(keys.out_tangents[1], after, atol=1e-14)
    np.testing.assert_allclose(keys.in_tangents[1], before, atol=1e-14)


def test_centripetal_is_barry_and_goldmans() -> None:
    """The Hermite piece equals the recursive construction on knots √|Δp|, as a path."""
    p = VALUES[:4]
    s = np.append(0.0, np.cumsum(np.sqrt(np.linalg.norm(np.diff(p, axis=0), axis=1))))
    t = np.linspace(s[1], s[2], 50)[:, None]

    def between(a: Floats, b: Floats, i: int, j: int) -> Floats:
        return np.asarray((s[j] - t) / (s[j] - s[i]) * a + (t - s[i]) / (s[j] - s[i]) * b)

    a1, a2, a3 = between(p[0], p[1], 0, 1), between(p[1], p[2], 1, 2), between(p[2], p[3], 2, 3)
    expected = between(between(a1, a2, 0, 2), between(a2, a3, 1, 3), 1, 2)
    keys = apply_tangents(TIMES[:4], p, TANGENTS["centripetal"])
    np.testing.assert_allclose(piece(TIMES, keys, 1, np.linspace(0, 1, 50)), expected, atol=1e-13)


def test_centripetal_rests_at_repeated_points() -> None:
    keys = apply_tangents(np.arange(4.0), np.array([[0.0], [1], [1], [3]]), TANGENTS["centripetal"])
    assert np.abs(keys.out_tangents[1]).max() < 1e-6
    assert np.abs(keys.in_tangents[2]).max() < 1e-6
    still = apply_tangents(np.arange(3.0), np.ones((3, 2)), TANGENTS["centripetal"])
    assert not still.out_tangents.any()


def test_bspline_with_even_spacing_is_the_classic_one() -> None:
    times = np.arange(9) * 0.5
    keys = apply_tangents(times, VALUES, TANGENTS["bspline"])
    np.testing.assert_allclose(keys.values[1:-1], (VALUES[:-2] + 4 * VALUES[1:-1] + VALUES[2:]) / 6, atol=1e-14)
    np.testing.assert_allclose(keys.values[[0, -1]], VALUES[[0, -1]], atol=1e-14)
    assert keys.departure == pytest.approx(np.linalg.norm(keys.values - VALUES, axis=1).max())
    phantom = np.concatenate((2 * VALUES[:1] - VALUES[1:2], VALUES, 2 * VALUES[-1:] - VALUES[-2:-1]))
    classic = BSpline(np.arange(-3, 12) * 0.5, phantom, 3)
    np.testing.assert_allclose(keys.out_tangents[:-1], classic(times, 1)[:-1], atol=1e-13)


@given(st.lists(st.floats(-10, 10), min_size=2, max_size=12))
def test_monotone_stays_between_keys(values: list[float]) -> None:
    v = np.array(values)[:, None]
    keys = apply_tangents(np.arange(len(v)), v, TANGENTS["monotone"])
    for k in range(len(v) - 1):
        curve = piece(np.arange(float(len(v))), keys, k, np.linspace(0, 1, 50))
        assert curve.min() >= v[k : k + 2].min() - 1e-12
        assert curve.max() <= v[k : k + 2].max() + 1e-12


def test_every_rule_handles_random_loops() -> None:
    for name in EVERY:
        keys = apply_tangents(TIMES, VALUES, parse(name), cyclic=True)
        assert np.isfinite((keys.in_tangents, keys.out_tangents)).all()
        np.testing.assert_allclose(keys.values[-1] - keys.values[0], VALUES[-1] - VALUES[0], atol=1e-12)


def test_refusals() -> None:
    with pytest.raises(RangeError, match=r"loop is open: its last key is .*°"):
        apply_rotation_tangents(TIMES, TURNS, TANGENTS["periodic"])
    with pytest.raises(ShapeError, match="9 values for 8 times"):
        apply_tangents(TIMES[:8], VALUES, TANGENTS["flat"])
    with pytest.raises(RangeError, match="not increasing"):
        apply_tangents([0, 0, 1], VALUES[:3], TANGENTS["flat"])
    with pytest.raises(RangeError, match="tension is 2"):
        parse("cardinal(2)")
    with pytest.raises(RangeError) as refusal:
        parse("catmul-rom")
    assert "did you mean 'catmull-rom'" in str(refusal.value)
    with pytest.raises(RangeError) as refusal:
        parse("tcb(1)")
    assert refusal.value.help == f"write {TANGENT_FACTORIES['tcb'].usage}"
