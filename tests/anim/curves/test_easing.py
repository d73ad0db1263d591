"""Every ease against its definition: ends, slope, exact form, symmetry; and against independent evaluations."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from anim.arrays import Floats
from anim.curves.ease import Easing, evaluate
from anim.curves.easing import EASING_MAKERS, EASINGS, parse, sparkline
from anim.curves.physical import settle_time, spring
from anim.errors import RangeError

WITH_ARGUMENTS = [
    "cubic-bezier(0.2, 0, 0, 1)",
    "cubic-bezier(1/3, -0.4, 2/3, 1.7)",
    "cubic-bezier(0, 1.5, 1, -0.5)",
    "cubic-bezier(0.5, 0.5, 0.5, 0.5)",
    "cubic-bezier(1, 0, 0, 1)",
    "spring(100, 10)",
    "spring(100, 2)",
    "spring(100, 20)",
    "spring(100, 300)",
    "hermite(-1, 4)",
    "back(3)",
    "back-in(0.5)",
    "back-in-out(2)",
]
SMOOTH = [*EASINGS, *WITH_ARGUMENTS]
STEPS = ["steps(1)", "steps(5)", "steps(4, jump-start)", "steps(3, both)", "steps(3, none)"]
U = np.linspace(0, 1, 1001)
EDGES = np.array([0.0, 1.0])
FAMILIES = ["quad", "cubic", "quart", "quint", "sine", "expo", "circ", "back", "elastic", "bounce"]


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
    assert exact == forms | {"linear", "smoothstep"}
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


@pytest.mark.parametrize(("stiffness", "damping"), [(100, 3), (100, 10), (40, 2 * 40**0.5), (100, 21), (9, 300)])
def test_spring_solves_its_equation(stiffness: float, damping: float) -> None:
    end = settle_time(stiffness, damping)
    u = np.linspace(0, 1, 50)
    path = solve_ivp(
        lambda _, y: [y[1], stiffness * (1 - y[0]) - damping * y[1]],
        (0, end),
        [0.0, 0.0],
        t_eval=u * end,
        method="LSODA",
        rtol=1e-9,
        atol=1e-11,
    )
    assert abs(path.y[0, -1] - 1) < 1.001e-3
    np.testing.assert_allclose(spring(stiffness, damping).value(u), path.y[0] / path.y[0, -1], atol=1e-6)


def test_spring_swings_past_by_the_closed_form() -> None:
    ratio = 0.3
    peak = 1 + math.exp(-math.pi * ratio / math.sqrt(1 - ratio**2))
    assert spring(25, 2 * ratio * 5).extent[1] == pytest.approx(peak, rel=1.1e-3)
    assert not spring(25, 10).overshoots


def test_settle_time_does_not_jump_with_the_damping() -> None:
    times = np.array([settle_time(100, d) for d in np.linspace(19.6, 20.4, 81)])
    assert np.abs(np.diff(times)).max() < 0.01
    assert settle_time(100, 20) == pytest.approx(0.9233, abs=1e-4)


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


@pytest.mark.parametrize("name", [*SMOOTH, *STEPS])
def test_name_is_what_makes_it(name: str) -> None:
    ease = parse(name)
    np.testing.assert_allclose(parse(ease.name).value(U), ease.value(U), atol=1e-13)


@pytest.mark.parametrize(
    ("text", "message", "help"),
    [
        ("quadin", "no ease is called 'quadin'", "'quad-in'"),
        ("easeInOutQuad", "no ease is called", "did you mean 'quad-in-out'?"),
        ("elastic", "no ease is called", "'elastic-in' or 'elastic-out'"),
        ("qwxyz", "no ease is called", "one of linear, smoothstep"),
        ("spring", "needs arguments", "write spring(stiffness, damping)"),
        ("spring(1)", "number of arguments is 1 (expected 2)", "write spring"),
        ("spring(0, 1)", "expected finite and above 0", ""),
        ("spring(100, 0.01)", "hardly settles", "a damping of 0.1 or more"),
        ("cubic-bezier(2, 0, 1, 1)", "time can't run backwards", "write cubic-bezier"),
        ("cubic-bezier(0, nan, 1, 1)", "finite", ""),
        ("hermite(1, inf)", "finite", ""),
        ("hermite(1, two)", "'two' is not a number", ""),
        ("steps(1.5)", "whole number", "write steps"),
        ("steps(nan)", "whole number", ""),
        ("steps(1, none)", "expected 2", ""),
        ("steps(3, jump-up)", "expected jump-start", ""),
        ("back(-1)", "overshoot is -1", ""),
        ("linear(1)", "takes no arguments", ""),
        ("ease(", "can't read ease", ""),
        ("", "can't read ease", ""),
    ],
)
def test_refusals(text: str, message: str, help: str) -> None:
    with pytest.raises(RangeError) as refusal:
        parse(text)
    assert message in str(refusal.value)
    assert help in refusal.value.help


def test_case_and_spaces_do_not_matter() -> None:
    assert parse("  Quad-In ") is EASINGS["quad-in"]
    assert parse("Spring ( 100 ,10 )").name == "spring(100, 10)"


def test_table_names_are_the_eases_names() -> None:
    assert all(name == ease.name for name, ease in EASINGS.items())
    assert all(maker.usage.startswith(f"{name}(") for name, maker in EASING_MAKERS.items())
    assert [f"{f}-{way}" for f in FAMILIES for way in ("in", "out", "in-out")] == [
        n for n in EASINGS if n.split("-")[0] in FAMILIES
    ]


def test_sparkline() -> None:
    assert sparkline(EASINGS["linear"], 8) == "▁▂▃▄▅▆▇█"
    assert sparkline(EASINGS["back-out"], 16)[-1] != "█"
    assert all(len(sparkline(ease, 30)) == 30 for ease in EASINGS.values())
    with pytest.raises(RangeError):
        sparkline(EASINGS["linear"], 1)


def test_any_shape_goes() -> None:
    grid: Floats = np.linspace(0, 1, 12).reshape(3, 4)
    eases: list[Easing] = [parse(name) for name in [*SMOOTH, *STEPS]]
    for ease in eases:
        assert ease.value(grid).shape == ease.derivative(grid).shape == (3, 4)
        assert np.shape(ease.value(np.array(0.5))) == ()
