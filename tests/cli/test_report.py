"""Numbers as people read them: no unit is left for its own thousandth or thousandfold."""

from __future__ import annotations

import pytest

from anim.units import format_number
from cli.text import format_bytes, format_change, format_length, format_speed


@pytest.mark.parametrize(
    ("meters", "words"),
    [
        (0, "0 mm"),
        (4.5e-16, "<0.01 nm"),
        (2.5e-9, "2.5 nm"),
        (9.94e-7, "990 nm"),
        (9.96e-7, "1 µm"),
        (1.2e-5, "12 µm"),
        (9.96e-5, "0.1 mm"),
        (0.00041, "0.41 mm"),
        (0.00996, "1 cm"),
        (0.015, "1.5 cm"),
        (0.994, "99 cm"),
        (0.9999, "1 m"),
        (2.9, "2.9 m"),
        (28_000, "28000 m"),
    ],
)
def test_a_length_has_the_unit_in_which_it_is_short(meters: float, words: str) -> None:
    assert format_length(meters) == words


@pytest.mark.parametrize(
    ("count", "words"),
    [(0, "0 B"), (999, "999 B"), (1000, "1 kB"), (42_345, "42.3 kB"), (999_499, "999 kB"), (999_500, "1 MB")],
)
def test_a_size_has_three_digits(count: int, words: str) -> None:
    assert format_bytes(count) == words


def test_digits_are_never_an_exponent() -> None:
    assert format_number(283_456, 2) == "280000"
    assert format_number(0.000_012_34, 2) == "0.000012"
    assert format_speed(0.4567) == "0.46 m/s"


def test_a_change_in_percent_where_there_is_any() -> None:
    assert format_change(42_300, 9_100) == "42.3 kB → 9.1 kB (-78 %)"
    assert format_change(1000, 1001) == "1 kB → 1 kB"
    assert format_change(0, 10) == "0 B → 10 B"
