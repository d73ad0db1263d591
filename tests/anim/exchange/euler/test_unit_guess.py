"""What unit of length a skeleton is in."""

from __future__ import annotations

from anim.exchange.euler.unit_guess import guess_unit


def test_units_are_guessed_by_height() -> None:
    assert guess_unit(172).unit == "centimeters"
    assert guess_unit(1.8).scale == 1
    assert guess_unit(66).unit == "inches"
    assert guess_unit(1720).unit == "millimeters"
    assert guess_unit(0).scale == 1
