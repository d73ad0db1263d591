"""Tracks as lines: every point lies on the track, and what jumps does not run on."""

from __future__ import annotations

import numpy as np
import pytest

from anim.model import Track
from anim.sampling.track import sample
from anim.show.plots import polylines
from anim.show.plots.figure import format_number, separate_labels
from tests import clips
from tests.clips import CUBICSPLINE, STEP, about

TIMES = [0.0, 0.5, 2.0]
PLACES = np.array([[0.0, 0, 0], [1, 0, 0], [1, 6, 0]])
BEFORE, AFTER = np.array([[[0.0, 0, 0], [1, 1, 0], [0, 1, 0]], [[2.0, 0, 0], [3, 1, 0], [0, 0, 0]]])


def cubic() -> Track:
    return clips.track("translation", TIMES, PLACES, CUBICSPLINE, tangents=(BEFORE, AFTER))


@pytest.mark.parametrize(
    "track",
    [
        clips.track("translation", TIMES, PLACES),
        clips.track("rotation", TIMES, about("z", [0, 120, 30])),
        cubic(),
    ],
    ids=["linear", "rotation", "cubic"],
)
def test_values_lie_on_the_track(track: Track) -> None:
    line = polylines.value_line(track)
    np.testing.assert_allclose(line.values, sample(track, line.times), atol=1e-12)
    assert set(TIMES) <= set(line.times.tolist())


def test_speed_is_the_slope_of_the_values() -> None:
    track = cubic()
    line = polylines.speed_line(track)
    inside = ~np.isnan(line.values[:, 0]) & ~np.isin(line.times, TIMES)
    at, h = line.times[inside], 1e-6
    slope = (sample(track, at + h) - sample(track, at - h)) / (2 * h)
    np.testing.assert_allclose(line.values[inside, 0], np.linalg.norm(slope, axis=1), rtol=1e-5)


def test_speed_has_both_sides_of_a_key() -> None:
    line = polylines.speed_line(clips.track("translation", TIMES, PLACES))
    assert set(line.values[line.times == 0.5, 0].tolist()) == {2.0, 4.0}
    cubics = polylines.speed_line(cubic())
    assert set(np.round(cubics.values[cubics.times == 0.5, 0], 9).tolist()) == {
        round(2**0.5, 9),
        round(10**0.5, 9),
    }


def test_steps_break_and_have_no_speed() -> None:
    track = clips.track("translation", TIMES, PLACES, STEP)
    line = polylines.value_line(track)
    assert np.isnan(line.values[2::3]).all()
    assert len(polylines.speed_line(track).times) == 0
    jumps = polylines.step_edges(track)
    np.testing.assert_array_equal(jumps.times[::3], [0.5, 2.0])
    np.testing.assert_array_equal(jumps.values[1], PLACES[1])


def test_a_jump_between_two_keys_breaks_the_speed() -> None:
    early = float(np.nextafter(np.float32(1), np.float32(0)))
    track = clips.track("weights", [0, early, 1, 2], [[0.0], [0.5], [0.8], [1.0]])
    line = polylines.speed_line(track)
    assert np.nanmax(line.values) == pytest.approx(0.5)
    assert np.isnan(line.values).sum() == 2


def test_angle_from_a_rotation() -> None:
    line = polylines.angle_line(clips.track("rotation", TIMES, about("z", [10, 130, 10])), about("z", [10])[0])
    assert np.degrees(line.values.max()) == pytest.approx(120)
    assert line.values[0] == line.values[-1] == 0


def test_difference_has_its_maximum_between_keys() -> None:
    one = clips.track("translation", [0, 1, 2], [[0, 0, 0], [1, 0, 0], [0, 0, 0]])
    other = clips.track("translation", [0, 2], [[0, 0, 0], [0, 0, 0]])
    line = polylines.difference_line(one, other)
    assert line.values.max() == 1
    assert line.times[line.values[:, 0].argmax()] == 1
    turned = polylines.difference_line(
        clips.track("rotation", [0, 1], about("x", [0, 30])), clips.track("rotation", [0, 1], -about("x", [0, 10]))
    )
    assert np.degrees(turned.values.max()) == pytest.approx(20)


def test_handles_are_a_third_of_the_way() -> None:
    times, values = polylines.handles(cubic())
    np.testing.assert_allclose(times, [[0, 1 / 6], [0.5, 1], [0.5, 1 / 3], [2, 1.5]])
    np.testing.assert_allclose(values[0, :, 0], [0, 1 / 3])
    np.testing.assert_allclose(values[3, :, 1], [6, 5.5])


@pytest.mark.parametrize(
    ("places", "expected"),
    [
        ([1.0, 1.0, 5.0], [0.0, 2.0, 5.0]),
        ([8.9, 9.0, 0.0], [7.0, 9.0, 0.0]),
        ([3.0], [3.0]),
        ([4.0, 4.0, 4.0], [2.0, 4.0, 6.0]),
        ([0.0, 1.9, 3.8, 5.7], [-0.15, 1.85, 3.85, 5.85]),
    ],
)
def test_names_keep_apart(places: list[float], expected: list[float]) -> None:
    low = -1.0 if expected[0] < 0 else 0.0
    assert separate_labels(places, 2.0, low, 9.0) == pytest.approx(expected)


def test_short_numbers() -> None:
    assert [format_number(x) for x in (0.0, 1e-4, 123456.0, -2.5, 1 / 3)] == ["0", "0.0001", "123000", "−2.5", "0.333"]


def test_a_line_of_very_many_points_keeps_its_extremes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(polylines, "DENSE_KEYS", 1000)
    values = np.random.default_rng(1).normal(size=(50_001, 2))
    values[40_000:40_030] = np.nan
    line = polylines.Polyline(np.linspace(0, 1, 50_001), values)
    short = polylines.keep_extremes(line)
    assert len(short.times) <= 2 * polylines.DENSE_SPANS
    assert (np.diff(short.times) >= 0).all()
    assert (short.times[0], short.times[-1]) == (0, 1)
    for extreme in (np.nanmin, np.nanmax):
        np.testing.assert_array_equal(extreme(short.values, axis=0), extreme(values, axis=0))
    assert np.isnan(short.values).any()
    few = polylines.Polyline(line.times[:4000], values[:4000])
    assert polylines.keep_extremes(few) is few


def test_dense_keys_have_no_points_between_them(monkeypatch: pytest.MonkeyPatch) -> None:
    track = clips.track("rotation", np.arange(20.0), about("z", np.arange(20.0)))
    many = len(polylines.value_line(track).times)
    monkeypatch.setattr(polylines, "DENSE_KEYS", 10)
    assert many > len(polylines.value_line(track).times) == 20
