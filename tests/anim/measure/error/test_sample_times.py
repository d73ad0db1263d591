"""Times of comparison: linear in keys for long clips, speeds and errors of those found all the same."""

from __future__ import annotations

import numpy as np
import pytest

from anim.measure.error import sample_times
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import MAX_SPARSE_TIMES, cut_times, dense_times, grid_times
from anim.measure.error.statistics import speed_error
from anim.model import Clip
from anim.sampling.times import frame_times
from tests.anim.measure.error.brute_force import points_on_a_node
from tests.clips import clip, track

HOURS_S = 40_000.0


def _long(keys: int, shift: float = 0.0) -> Clip:
    times = np.linspace(0, HOURS_S, keys).astype(np.float32).astype(np.float64)
    values = np.random.default_rng(1).normal(size=(keys, 3))
    values[keys // 2] += shift
    return clip(track("translation", times, values))


def test_times_of_long_clips_are_few_and_in_every_interval() -> None:
    for times in (dense_times(_long(20)), grid_times(_long(20)), cut_times(_long(20), parts=4, step=1 / 480)):
        assert len(times) < 2 * MAX_SPARSE_TIMES
        assert (times[0], times[-1]) == (0, HOURS_S)
        assert (np.diff(times) > 0).all()
        assert (np.histogram(times, _long(20).key_times)[0] >= sample_times.MIN_TIMES_PER_INTERVAL).all()


def test_pairs_of_the_grid_are_neighboring_frames_of_it() -> None:
    frames, times = frame_times(0, HOURS_S, fps=120.0), grid_times(_long(20))
    chosen = np.searchsorted(frames, times)
    np.testing.assert_array_equal(frames[chosen], times)
    assert (np.diff(chosen) == 1).sum() > len(chosen) / 3


@pytest.mark.parametrize("keys", [2, 300])
def test_clips_of_a_minute_have_all_frames(keys: int) -> None:
    short = clip(track("translation", np.linspace(0, 60, keys), np.zeros((keys, 3))))
    np.testing.assert_array_equal(grid_times(short), frame_times(0, 60, fps=120.0))


def test_speeds_of_long_clips_are_those_of_the_whole_grid() -> None:
    before, after = _long(40), _long(40, shift=5.0)
    interval = HOURS_S / 39
    expected = 5 * np.sqrt(3) / interval  # m/s, of lines to and from the moved key
    found = speed_error(ErrorMetric(points_on_a_node([[0.0, 0.0, 0.0]])), before, after)
    assert found.size == pytest.approx(expected, rel=0.011)
