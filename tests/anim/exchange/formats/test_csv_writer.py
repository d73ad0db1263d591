"""Texts of numbers in CSV, many at once, against one by one; and frames in blocks."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.exchange.euler.curve import Curve, Mode, uniform_modes
from anim.exchange.euler.motion import Convention, EulerMotion, EulerNode, Unit
from anim.exchange.formats import csv_writer
from anim.maths.euler import AxesConvention
from anim.model import TimeAxis

CHANCE = np.random.default_rng(1)
HALVES = (CHANCE.integers(-(10**9), 10**9, 2000) + 0.5) / 1e9


@pytest.mark.parametrize(
    "values",
    [
        CHANCE.normal(size=5000),
        HALVES,
        np.nextafter(HALVES, np.inf),
        HALVES * 1e3,
        10 ** CHANCE.uniform(-320, 300, 5000),
        np.repeat([0.0, -0.0, 1.5, 1e-10, -1e-10, 5e-10, -5e-10, 100.0], 100),
    ],
)
def test_many_numbers_have_the_texts_of_each(values: Floats) -> None:
    assert csv_writer._texts(values) == [csv_writer._text(value) for value in values.tolist()]


def test_frames_in_blocks_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    axes = TimeAxis(np.arange(0, 30) / 10), TimeAxis(np.arange(5, 40, 3) / 10)
    curves = [Curve(axis, np.sin(axis.times), uniform_modes(len(axis), Mode.LINEAR)) for axis in axes]
    none = np.zeros(3)
    frame = AxesConvention.INTRINSIC
    node = EulerNode("n", -1, none, "XYZ", frame, none, (curves[0], curves[1], None))
    convention = Convention("XYZ", frame, Unit.DEG)
    whole = csv_writer.write(EulerMotion((node,)), convention)
    assert whole.count(b"\n") == 36
    monkeypatch.setattr(csv_writer, "MAX_BLOCK_ROWS", 7)
    assert csv_writer.write(EulerMotion((node,)), convention) == whole
