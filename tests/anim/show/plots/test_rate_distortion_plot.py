"""The picture of size against error: which words it holds, and that it is the same every time."""

from __future__ import annotations

import pytest

from anim.errors import RangeError
from anim.optimization.rate_distortion import RatePoint
from anim.show.plots.rate_distortion_plot import rate_distortion_plot
from tests.anim.show.reading import png_size, words

SIZES = [
    RatePoint(0, 160_000, 0, 60_400),
    RatePoint(2e-4, 141_234, 1.9e-4, 41_234),
    RatePoint(2e-3, 130_000, 1.9e-3, 30_000),
    RatePoint(2e-2, 112_500, 1e-2, 12_500),
]


def test_every_size_and_bound_is_written_out() -> None:
    said = words(rate_distortion_plot(SIZES, 2.0, title="Fox", kind="svg"))
    for expected in ("Fox", "41.2 kB", "30 kB", "12.5 kB", "0.01 %", "0.1 %", "1 %"):
        assert expected in said, expected


def test_the_same_picture_twice_and_another_for_other_sizes() -> None:
    one, again = (rate_distortion_plot(SIZES, 2.0, title="Fox", kind="png") for _ in range(2))
    assert one == again
    assert one != rate_distortion_plot(SIZES[:2], 2.0, title="Fox", kind="png")
    assert min(png_size(one)) > 300


def test_one_size() -> None:
    assert "41.2 kB" in words(rate_distortion_plot(SIZES[1:2], 2.0, title="", kind="svg"))


def test_source_and_floor_are_marked() -> None:
    said = words(rate_distortion_plot(SIZES, 2.0, title="Fox", kind="svg", source=250_000))
    for expected in ("source  250 kB", "without loss  60.4 kB", "floor  12.5 kB"):
        assert expected in said, expected
    plain = words(rate_distortion_plot(SIZES[1:], 2.0, title="Fox", kind="svg"))
    assert not any(text.startswith(("source", "without")) for text in plain)


def test_other_kinds_are_refused() -> None:
    with pytest.raises(RangeError):
        rate_distortion_plot(SIZES, 2.0, title="", kind="bmp")
