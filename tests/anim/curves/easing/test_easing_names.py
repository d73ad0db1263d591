"""Eases by name: every one is what its name says, and what is none is told what was meant."""

from __future__ import annotations

import numpy as np
import pytest

from anim.curves.easing.table import EASING_FACTORIES, EASINGS, parse, sparkline
from anim.errors import RangeError
from tests.anim.curves.easing.eases import FAMILIES, SMOOTH, STEPS, U


@pytest.mark.parametrize("name", [*SMOOTH, *STEPS])
def test_name_is_what_makes_it(name: str) -> None:
    ease = parse(name)
    np.testing.assert_allclose(parse(ease.name).value(U), ease.value(U), atol=1e-13)


@pytest.mark.parametrize(
    ("text", "message", "help"),
    [
        ("quadin", "unknown easing 'quadin' (did you mean 'quad-in'", "see `EASINGS`"),
        ("easeInOutQuad", "unknown easing 'easeInOutQuad' (did you mean 'quad-in-out'?)", "`EASINGS`"),
        ("elastic", "(did you mean 'elastic-in' or 'elastic-out'", "`EASINGS`"),
        ("bounzy", "unknown easing 'bounzy' (did you mean 'bounce-in'", "`EASINGS`"),
        ("qwxyz", "unknown easing 'qwxyz'", "see `EASINGS`"),
        ("spring", "requires arguments", "write spring(stiffness, damping)"),
        ("spring(1)", "number of arguments is 1 (expected 2)", "write spring"),
        ("spring(0, 1)", "expected finite and above 0", ""),
        ("spring(100, 0.01)", "hardly settles", "a damping of 0.1 or more"),
        ("cubic-bezier(2, 0, 1, 1)", "time can't run backwards", "write cubic-bezier"),
        ("cubic-bezier(0, nan, 1, 1)", "expected -100 … 100", ""),
        ("hermite(1, inf)", "expected -100 … 100", ""),
        ("back-in(1e300)", "expected 0 … 100", ""),
        ("hermite(1, two)", "'two' is not a number", ""),
        ("steps(1.5)", "whole number", "write steps"),
        ("steps(nan)", "whole number", ""),
        ("steps(1, none)", "expected 2", ""),
        ("steps(3, jump-up)", "expected jump-start", ""),
        ("back(-1)", "overshoot is -1", ""),
        ("linear(1)", "takes no arguments", ""),
        ("ease(", "can't read easing", ""),
        ("", "can't read easing", ""),
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
    assert all(maker.usage.startswith(f"{name}(") for name, maker in EASING_FACTORIES.items())
    for name, maker in EASING_FACTORIES.items():
        assert maker.examples, f"add examples of {name} to its Factory"
        assert all(each.startswith(f"{name}(") for each in maker.examples), name
    assert [f"{f}-{way}" for f in FAMILIES for way in ("in", "out", "in-out")] == [
        n for n in EASINGS if n.split("-")[0] in FAMILIES
    ]


def test_sparkline() -> None:
    assert sparkline(EASINGS["linear"], 8) == "▁▂▃▄▅▆▇█"
    assert sparkline(EASINGS["back-out"], 16)[-1] != "█"
    assert all(len(sparkline(ease, 30)) == 30 for ease in EASINGS.values())
    with pytest.raises(RangeError):
        sparkline(EASINGS["linear"], 1)
