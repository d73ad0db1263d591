"""Pictures of eases and tangent rules: the right kind, the same bytes every time, and the facts in words."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from anim.curves.easing.table import EASINGS, parse
from anim.curves.fitting.easing_fit import fit_segments
from anim.curves.tangents.table import TANGENTS
from anim.errors import RangeError, ShapeError, UnsupportedError
from anim.show.plots.easing_plot import LIMIT, easing_plot
from anim.show.plots.tangent_plot import tangent_plot
from tests.anim.show.reading import png_size, words


def test_eases_say_what_they_are() -> None:
    said = words(
        easing_plot([parse("smoothstep"), parse("back-out"), parse("steps(4)"), parse("sine-in-out")], kind="svg")
    )
    count = len(fit_segments(parse("sine-in-out"), tolerance=1e-3))
    for expected in (
        "smoothstep", "exact as 1 cubic", "back-out", "+10 %", "exact as STEP keys", f"{count} cubics within 0.1 %",
        "speed f′, at most 1.5×", "speed f′, only jumps", "tempo: every 1/20 of the time",
    ):  # fmt: skip
        assert expected in said, expected


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_same_bytes_every_time(kind: str) -> None:
    pictures = {easing_plot([parse("bounce-out"), parse("elastic-in")], kind=kind) for _ in range(2)}
    assert len(pictures) == 1
    assert len({tangent_plot(range(4), [0, 0.9, 0.2, 1], ["natural"], kind=kind) for _ in range(2)}) == 1


def test_a_sheet_is_as_wide_as_its_row() -> None:
    one, three = (png_size(easing_plot([parse("linear")] * count, kind="png")) for count in (1, 3))
    assert three[0] > 2 * one[0] > 0
    assert three[1] == one[1]


@pytest.mark.slow
def test_all_eases_can_be_drawn() -> None:
    names = [*EASINGS, "spring(100, 10)", "steps(3, jump-both)", "cubic-bezier(1, 0, 0, 1)", "hermite(-9, 40)"]
    for i in range(0, len(names), LIMIT):
        part = names[i : i + LIMIT]
        said = words(easing_plot([parse(name) for name in part], kind="svg"))
        assert {parse(name).name for name in part} <= set(said)


@pytest.mark.parametrize("count", [0, LIMIT + 1])
def test_too_few_and_too_many_eases(count: int) -> None:
    with pytest.raises(RangeError, match=f"{count} eases"):
        easing_plot([parse("linear")] * count, kind="png")


def test_through_names_the_smoothness_of_each_rule() -> None:
    rules = ["catmull-rom", "natural", "linear", "step", "monotone", "bspline"]
    said = words(tangent_plot(range(4), [0, 0.9, 0.2, 1], rules, kind="svg"))
    assert set(rules) <= set(said)
    assert "Through 0, 0.9, 0.2, 1" in said
    # Catmull-Rom leaves 0.9 with 0.1 and reaches 0.2 with 0.05: its top is 0.90108 at 1.022 s
    assert "C1 at every key; overshoots by 0.00108" in said
    assert "C0 at every key; no overshoot" in said
    assert "jumps at every key; no overshoot" in said
    assert "C1 at every key; no overshoot" in said
    natural = CubicSpline(range(4), [0, 0.9, 0.2, 1], bc_type="natural")
    tops = natural(natural.derivative().roots(extrapolate=False))
    assert f"C2 at every key; overshoots by {max(tops.max() - 0.9, 0.2 - tops.min()):.3g}" in said
    # (v₋ + 4v + v₊) / 6 at 0.9 and 0.2, but for the ends: 0.9 − 0.6333 and 0.45 − 0.2
    assert any(text.startswith("C2 at every key; up to 0.2") and text.endswith("off the keys") for text in said)
    assert "overshoot, magnified" in said


def test_overshoot_by_hand() -> None:
    u = np.roots([3 * (2 * 0.7 + 0.1 + 0.05), 2 * (-3 * 0.7 - 2 * 0.1 - 0.05), 0.1])
    u = u[(u > 0) & (u < 0.5)]
    top = 0.9 + 0.1 * u + (-3 * 0.7 - 2 * 0.1 - 0.05) * u**2 + (2 * 0.7 + 0.1 + 0.05) * u**3
    np.testing.assert_allclose(top, [0.90108], atol=5e-6)


def test_all_rules_can_be_drawn() -> None:
    names = [*(name for name in TANGENTS if name != "periodic"), "cardinal(0.5)", "tcb(0, 1, 0)"]
    for i in range(0, len(names), 6):
        said = words(tangent_plot([0, 0.2, 1, 1.5, 4], [1, 0, 2, 2, 1], names[i : i + 6], kind="svg"))
        assert set(names[i : i + 6]) <= set(said)
    assert "periodic" in words(tangent_plot(range(3), [0, 1, 0], ["periodic"], kind="svg"))


def test_two_values_are_one_piece() -> None:
    assert "one segment; no overshoot" in words(tangent_plot([0, 1], [0, 1], ["natural"], kind="svg"))


def test_equal_values() -> None:
    assert "C2 at every key; no overshoot" in words(tangent_plot(range(3), [1, 1, 1], ["natural"], kind="svg"))


def test_refusals() -> None:
    with pytest.raises(RangeError, match="tangent rule"):
        tangent_plot(range(3), [0, 1, 0], ["catmul"], kind="svg")
    with pytest.raises(RangeError, match="7 tangent rules"):
        tangent_plot(range(3), [0, 1, 0], ["flat"] * 7, kind="svg")
    with pytest.raises(RangeError, match="not increasing"):
        tangent_plot([0, 1, 1], [0, 1, 0], ["flat"], kind="svg")
    with pytest.raises(ShapeError):
        tangent_plot([0, 1], [0, 1, 0], ["flat"], kind="svg")
    with pytest.raises(RangeError, match="`format` is 'pdf'"):
        easing_plot([parse("linear")], kind="pdf")


def test_the_users_style_does_not_count() -> None:
    import matplotlib

    plain = easing_plot([parse("linear")], kind="svg")
    with matplotlib.rc_context({"lines.linewidth": 9, "font.size": 40, "svg.fonttype": "path", "axes.grid": True}):
        assert easing_plot([parse("linear")], kind="svg") == plain
        assert matplotlib.rcParams["font.size"] == 40


def test_without_matplotlib(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(UnsupportedError, match="need matplotlib") as caught:
        easing_plot([parse("linear")], kind="png")
    assert caught.value.help == "pip install 'gltf-anim[plot]'"


def test_keys_of_each_grade_are_counted_as_keys() -> None:
    said = words(tangent_plot(range(5), [0, 1, 1, 1, 3], ["linear"], kind="svg"))
    assert "C0 at 2 keys, C2 at 1 key; no overshoot" in said
