"""Every ease against its definition: ends, slope, exact form, symmetry; and against independent evaluations."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.optimize import brentq

from anim.arrays import Floats
from anim.curves.easing.function import Easing, evaluate
from anim.curves.easing.table import EASINGS, parse
from tests.anim.curves.easing.eases import FAMILIES, SMOOTH, STEPS, U

ROOT = Path(__file__).resolve().parents[4]
EDGES = np.array([0.0, 1.0])


@pytest.mark.parametrize("name", [*SMOOTH, "steps(5)", "steps(3, none)"])
def test_goes_from_0_to_1(name: str) -> None:
    np.testing.assert_array_equal(parse(name).value(EDGES), [0, 1])


@pytest.mark.parametrize("name", SMOOTH)
def test_derivative_is_the_central_difference(name: str) -> None:
    ease = parse(name)
    step = 1e-6
    u = U[(U > 0.01) & (U < 0.99)] + 0.0003
    u = u[np.abs(u[:, None] - np.array([*ease.breakpoints, 2.0])).min(axis=1) > 0.01]
    difference = (ease.value(u + step) - ease.value(u - step)) / (2 * step)
    np.testing.assert_allclose(ease.derivative(u), difference, atol=1e-6 * max(1.0, np.abs(difference).max()))


@pytest.mark.parametrize("name", SMOOTH)
def test_derivative_at_the_ends_is_one_sided(name: str) -> None:
    ease = parse(name)
    start, end = ease.derivative(EDGES)
    rise = ease.value(np.array([1e-9, 1 - 1e-9]))
    for slope, difference in ((start, rise[0] / 1e-9), (end, (1 - rise[1]) / 1e-9)):
        if np.isinf(slope):
            assert abs(difference) > 1e3
        else:
            assert slope == pytest.approx(difference, abs=2e-4)


@pytest.mark.parametrize("name", [n for n in [*SMOOTH, *STEPS] if parse(n).exact is not None])
def test_exact_form_is_the_function(name: str) -> None:
    ease = parse(name)
    assert ease.exact is not None
    edges = [ease.exact[0].start, *(p.end for p in ease.exact)]
    assert edges == [0, *ease.breakpoints, 1]
    inner = U[1:-1]
    np.testing.assert_allclose(evaluate(ease.exact, inner), ease.value(inner), atol=1e-12)
    for p in ease.exact:
        slopes = ease.derivative(np.array([p.start + 1e-12, p.end - 1e-12]))
        np.testing.assert_allclose([p.slope0, p.slope1], slopes, atol=1e-9)


def test_those_have_an_exact_form() -> None:
    exact = {name for name, ease in EASINGS.items() if ease.exact is not None}
    forms = {f"{f}-{way}" for f in ("quad", "cubic", "back", "bounce") for way in ("in", "out", "in-out")}
    assert exact >= forms | {"linear", "smoothstep"}
    assert parse("cubic-bezier(1/3, 0, 2/3, 1)").exact == parse("smoothstep").exact
    assert parse("cubic-bezier(0.7, 0.7, 0.2, 0.2)").exact == parse("linear").exact


@pytest.mark.parametrize("family", FAMILIES)
def test_out_is_in_mirrored_and_in_out_is_odd(family: str) -> None:
    into, out, both = (EASINGS[f"{family}-{way}"] for way in ("in", "out", "in-out"))
    u = U[::7]
    np.testing.assert_allclose(out.value(u), 1 - into.value(1 - u), atol=1e-14)
    np.testing.assert_allclose(both.value(u), 1 - both.value(1 - u), atol=1e-14)
    if family not in ("back", "elastic", "sine"):
        np.testing.assert_allclose(both.value(u[u < 0.5]), into.value(2 * u[u < 0.5]) / 2, atol=1e-14)


def easings_net(name: str, x: float) -> float:
    """Penner's eases as published on easings.net, written plainly."""
    c1, c4, c5 = 1.70158, 2 * math.pi / 3, 2 * math.pi / 4.5
    c2 = c1 * 1.525
    formulas = {
        "quart-out": lambda: 1 - (1 - x) ** 4,
        "quint-in-out": lambda: 16 * x**5 if x < 0.5 else 1 - (-2 * x + 2) ** 5 / 2,
        "sine-in": lambda: 1 - math.cos(x * math.pi / 2),
        "sine-in-out": lambda: -(math.cos(math.pi * x) - 1) / 2,
        "expo-in": lambda: 2 ** (10 * x - 10),
        "expo-out": lambda: 1 - 2 ** (-10 * x),
        "expo-in-out": lambda: 2 ** (20 * x - 10) / 2 if x < 0.5 else (2 - 2 ** (-20 * x + 10)) / 2,
        "circ-in": lambda: 1 - math.sqrt(1 - x**2),
        "back-in": lambda: (c1 + 1) * x**3 - c1 * x**2,
        "back-out": lambda: 1 + (c1 + 1) * (x - 1) ** 3 + c1 * (x - 1) ** 2,
        "back-in-out": lambda: (
            (2 * x) ** 2 * ((c2 + 1) * 2 * x - c2) / 2
            if x < 0.5
            else ((2 * x - 2) ** 2 * ((c2 + 1) * (x * 2 - 2) + c2) + 2) / 2
        ),
        "elastic-in": lambda: -(2 ** (10 * x - 10)) * math.sin((x * 10 - 10.75) * c4),
        "elastic-out": lambda: 2 ** (-10 * x) * math.sin((x * 10 - 0.75) * c4) + 1,
        "elastic-in-out": lambda: (
            -(2 ** (20 * x - 10) * math.sin((20 * x - 11.125) * c5)) / 2
            if x < 0.5
            else 2 ** (-20 * x + 10) * math.sin((20 * x - 11.125) * c5) / 2 + 1
        ),
        "bounce-out": lambda: bounce(x),
    }
    return formulas[name]()


def bounce(x: float) -> float:
    n, d = 7.5625, 2.75
    if x < 1 / d:
        return n * x * x
    if x < 2 / d:
        return n * (x - 1.5 / d) ** 2 + 0.75
    if x < 2.5 / d:
        return n * (x - 2.25 / d) ** 2 + 0.9375
    return n * (x - 2.625 / d) ** 2 + 0.984375


@pytest.mark.parametrize(
    ("name", "tolerance"),
    [
        *((n, 1e-13) for n in ("quart-out", "quint-in-out", "sine-in", "sine-in-out", "circ-in", "bounce-out")),
        *((n, 1e-13) for n in ("back-in", "back-out", "back-in-out")),
        *((n, 1e-3) for n in ("expo-out", "expo-in-out", "elastic-in", "elastic-out", "elastic-in-out")),
    ],
)
def test_agrees_with_the_published_formula(name: str, tolerance: float) -> None:
    u = U[3:-3:13]
    np.testing.assert_allclose(EASINGS[name].value(u), [easings_net(name, float(x)) for x in u], atol=tolerance)


@pytest.mark.parametrize("family", ["expo", "elastic"])
def test_scaled_easings_reach_both_ends_and_differ_from_the_published_ones_by_a_thousandth(family: str) -> None:
    """The figure of `ease --help`, `ease --list` and the page on easings; u = 0 and 1 are the limits from inside."""
    u = np.linspace(0, 1, 20001)
    for form, largest in (("in", 2.0**-10), ("out", 2.0**-10), ("in-out", 2.0**-11)):
        name = f"{family}-{form}"
        found = EASINGS[name].value(u)
        published = np.array([easings_net(name, float(x)) for x in u])
        assert (found[0], found[-1]) == (0, 1)
        assert max(abs(published[0]), abs(published[-1] - 1)) > 5e-5
        assert 0.998 * largest < np.abs(found - published).max() <= largest


def test_the_largest_difference_from_other_libraries_is_stated() -> None:
    page = (ROOT / "docs/ideas/easing.md").read_text(encoding="utf-8")
    assert f"2⁻¹⁰ ≈ {2.0**-10:.3f}" in page
    u = np.linspace(0, 1, 2001)
    beziers = {"expo-in": "0.7, 0, 0.84, 0", "expo-out": "0.16, 1, 0.3, 1", "expo-in-out": "0.87, 0, 0.13, 1"}
    far = max(
        float(np.abs(EASINGS[name].value(u) - parse(f"cubic-bezier({handles})").value(u)).max())
        for name, handles in beziers.items()
    )
    assert f"differs by up to {far:.2f}" in page


def bezier(x1: float, y1: float, x2: float, y2: float, u: float) -> float:
    """A Bézier ease by De Casteljau's construction and scipy's root finder."""

    def point(s: float) -> tuple[float, float]:
        p = [(0.0, 0.0), (x1, y1), (x2, y2), (1.0, 1.0)]
        while len(p) > 1:
            p = [((1 - s) * a[0] + s * b[0], (1 - s) * a[1] + s * b[1]) for a, b in pairwise(p)]
        return p[0]

    return point(brentq(lambda s: point(s)[0] - u, 0, 1, xtol=1e-15, rtol=1e-14))[1]


@pytest.mark.parametrize(
    ("name", "handles"),
    [
        ("ease", (0.25, 0.1, 0.25, 1.0)),
        ("ease-in", (0.42, 0.0, 1.0, 1.0)),
        ("ease-out", (0.0, 0.0, 0.58, 1.0)),
        ("ease-in-out", (0.42, 0.0, 0.58, 1.0)),
        ("cubic-bezier(.2,0,0,1)", (0.2, 0.0, 0.0, 1.0)),
        ("cubic-bezier(0.9, -1, 0.1, 2)", (0.9, -1.0, 0.1, 2.0)),
    ],
)
def test_bezier_agrees_with_de_casteljau(name: str, handles: tuple[float, float, float, float]) -> None:
    u = np.linspace(0.002, 0.998, 60)
    np.testing.assert_allclose(parse(name).value(u), [bezier(*handles, float(x)) for x in u], atol=1e-11)


@example(1.0, 2.220446049250313e-16, 0.0, 0.0)  # nearly vertical in the middle
@given(*(st.floats(0, 1) for _ in range(2)), *(st.floats(-2, 3) for _ in range(2)))
def test_bezier_meets_its_ends_and_stays_a_function(x1: float, x2: float, y1: float, y2: float) -> None:
    ease = parse(f"cubic-bezier({x1!r}, {y1!r}, {x2!r}, {y2!r})")
    values = ease.value(U)
    assert values[0] == 0
    assert values[-1] == 1
    assert values.min() >= min(0.0, y1, y2) - 1e-12
    assert values.max() <= max(1.0, y1, y2) + 1e-12
    if 0 <= y1 <= y2 <= 1:
        assert (np.diff(values) >= -1e-12).all()
    assert not np.isnan(ease.derivative(U)).any()


def test_steps_by_hand() -> None:
    u = np.array([0, 0.49, 0.5, 0.99, 1])
    np.testing.assert_allclose(parse("steps(2)").value(u), [0, 0, 0.5, 0.5, 1])
    np.testing.assert_allclose(parse("steps(2, jump-start)").value(u), [0.5, 0.5, 1, 1, 1])
    np.testing.assert_allclose(parse("steps(2, jump-both)").value(u), [1 / 3, 1 / 3, 2 / 3, 2 / 3, 1])
    np.testing.assert_allclose(parse("steps(2, jump-none)").value(u), [0, 0, 1, 1, 1])
    np.testing.assert_array_equal(parse("steps(100)").value(np.arange(101) / 100), np.arange(101) / 100)


def test_only_steps_are_stepped() -> None:
    assert all(parse(name).stepped for name in STEPS)
    assert not any(parse(name).stepped for name in SMOOTH)


def test_overshoot_is_known() -> None:
    over = {name for name, ease in EASINGS.items() if ease.overshoots}
    assert over == {f"{f}-{way}" for f in ("back", "elastic") for way in ("in", "out", "in-out")}
    assert EASINGS["back-out"].extent == pytest.approx((0, 1.1), abs=1e-5)
    assert EASINGS["back-in-out"].extent == pytest.approx((-0.1, 1.1), abs=2e-4)
    assert parse("back(3)").extent == pytest.approx((0, 1.25))


def test_any_shape_goes() -> None:
    grid: Floats = np.linspace(0, 1, 12).reshape(3, 4)
    eases: list[Easing] = [parse(name) for name in [*SMOOTH, *STEPS]]
    for ease in eases:
        assert ease.value(grid).shape == ease.derivative(grid).shape == (3, 4)
        assert np.shape(ease.value(np.array(0.5))) == ()
