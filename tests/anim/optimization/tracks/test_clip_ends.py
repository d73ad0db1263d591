"""Tracks held and stretched so that a clip keeps its length."""

from __future__ import annotations

import numpy as np
import pytest

from anim.model import Interpolation, Track
from anim.optimization.tracks.clip_ends import extend, single_key
from anim.sampling.track import sample

LINE = Track(0, "translation", Interpolation.LINEAR, np.array([1.0, 2.0]), np.array([[1.0, 0, 0], [3.0, 0, 0]]))
SPLINE = Track(0, "scale", Interpolation.CUBICSPLINE, LINE.times, LINE.values, 5 * np.ones((2, 3)), 7 * np.ones((2, 3)))


@pytest.mark.parametrize("interpolation", [Interpolation.LINEAR, Interpolation.STEP])
def test_held_is_the_first_value_alone(interpolation: Interpolation) -> None:
    found = single_key(Track(0, "translation", interpolation, LINE.times, LINE.values))
    assert (found.times.tolist(), found.values.tolist()) == ([1.0], [[1.0, 0, 0]])
    assert found.interpolation is interpolation


def test_a_spline_is_held_by_a_line() -> None:
    assert single_key(SPLINE).interpolation is Interpolation.LINEAR


@pytest.mark.parametrize("track", [LINE, SPLINE])
@pytest.mark.parametrize(("start", "end"), [(0.0, 2.0), (1.0, 4.0), (0.5, 3.0), (1.0, 2.0)])
def test_stretched_reaches_both_ends_and_shows_the_same(track: Track, start: float, end: float) -> None:
    found = extend(track, start, end)
    at = np.linspace(start - 1, end + 1, 301)
    assert (found.times[0], found.times[-1]) == (start, end)
    np.testing.assert_allclose(sample(found, at), sample(track, at), atol=1e-12)


def test_a_single_key_becomes_two() -> None:
    single = Track(0, "translation", Interpolation.LINEAR, np.array([1.0]), np.array([[1.0, 0, 0]]))
    assert extend(single, 0.0, 2.0).times.tolist() == [0, 2]
    assert extend(single, 1.0, 2.0).times.tolist() == [1, 2]
