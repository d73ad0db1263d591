"""Numbers with units: what is no finite number is refused."""

from __future__ import annotations

import pytest

from anim.errors import RangeError
from anim.units import FEW, format_number, list_some, parse_angle, parse_fraction, parse_length, plural
from cli.text import format_instant, format_length, format_time


def test_a_number_beyond_float64_is_refused() -> None:
    """As infinity it would pass every limit: `diff --fail-above 1e400m` never failed."""
    with pytest.raises(RangeError, match="1e400mm"):
        parse_length("1e400mm", "max_error", lambda: 1.0)
    with pytest.raises(RangeError, match="1e999%"):
        parse_length("1e999%", "max_error", lambda: 1.0)
    with pytest.raises(RangeError, match="1e400"):
        parse_fraction("1e400", "tolerance")
    with pytest.raises(RangeError, match="1e400deg"):
        parse_angle("1e400deg", "tolerance")
    assert parse_length("1e300mm", "max_error", lambda: 1.0) == pytest.approx(1e297)


def test_fractions_have_a_limit() -> None:
    assert parse_length("1e8%", "max_error", lambda: 2.0) == 2e6
    assert parse_fraction("1e6", "tolerance") == 1e6
    with pytest.raises(RangeError, match=r"^max_error is '1e308%' \(expected at most 1e\+08%\)$"):
        parse_length("1e308%", "max_error", lambda: 2.0)
    with pytest.raises(RangeError, match=r"^tolerance is '1\.1e6' \(expected at most 1e\+08%\)$"):
        parse_fraction("1.1e6", "tolerance")


def test_a_count_has_its_noun_in_the_singular_or_plural() -> None:
    assert [plural(count, "clip") for count in (0, 1, 2)] == ["0 clips", "1 clip", "2 clips"]
    assert [plural(count, "vertex", "vertices") for count in (1, 2)] == ["1 vertex", "2 vertices"]


def test_of_many_names_some_are_listed() -> None:
    names = list("abcdefghi")
    assert list_some(names[:8]) == "a, b, c, d, e, f, g, h"
    assert list_some(names) == "a, b, c, d, e, f, g, h and 1 more"
    assert list_some(names, FEW) == "a, b, c and 6 more"


@pytest.mark.parametrize(("value", "text"), [(1e300, "1e+300"), (-3.4e38, "-3.4e+38"), (123_456_789.0, "123000000")])
def test_numbers_without_meaningful_digits_have_an_exponent(value: float, text: str) -> None:
    assert format_number(value, 3) == text
    assert all(len(each(value)) < 16 for each in (format_length, format_time, format_instant) if value > 0)
