"""Frame rates of key times that were made at known ones."""

from __future__ import annotations

import numpy as np
import pytest

from anim.measure.inspect.frame_rate import USUAL_FPS, FrameRate, estimate_frame_rate


@pytest.mark.parametrize("fps", USUAL_FPS.tolist())
def test_every_usual_rate_is_known_again_from_float32_times(fps: float) -> None:
    times = (np.arange(40) / fps).astype(np.float32).astype(np.float64)
    assert estimate_frame_rate(times) == FrameRate(fps, 1.0)


def test_an_unusual_even_rate_is_what_it_is() -> None:
    found = estimate_frame_rate(np.arange(20) / 17.3)
    assert found is not None
    assert found.fps == pytest.approx(17.3, rel=1e-9)


def test_where_keys_are_missing_the_slowest_usual_rate_fits() -> None:
    assert estimate_frame_rate(np.array([0, 0.25, 0.5, 1])) == FrameRate(12.0, 1.0)
    assert estimate_frame_rate(np.delete(np.arange(60), [3, 4, 17, 30, 31]) / 30) == FrameRate(30.0, 1.0)


def test_an_end_between_two_frames_does_not_count() -> None:
    times = np.append(np.arange(30) / 30, 29.4 / 30)
    assert estimate_frame_rate(times) == FrameRate(30.0, 1.0)


def test_a_start_that_is_late_does_not_count_either() -> None:
    assert estimate_frame_rate(3.7 + np.arange(30) / 24) == FrameRate(24.0, 1.0)


@pytest.mark.parametrize("count", [50, 51])
def test_keys_on_no_grid_give_the_inverse_of_their_median_distance(count: int) -> None:
    steps = np.random.default_rng(count).uniform(0.011, 0.083, count)
    times = np.cumsum(steps)
    kept = times if np.diff(times)[-1] >= 0.98 * np.median(np.diff(times)) else np.append(times, times[-1] + 0.09)
    found = estimate_frame_rate(kept)
    assert found is not None
    assert found.fps == pytest.approx(1 / np.median(np.diff(kept)), rel=1e-3)
    assert found.regular < 0.5


@pytest.mark.parametrize("times", [[], [1.0], [0.0, 0.5]])
def test_too_few_keys_leave_it_open(times: list[float]) -> None:
    assert estimate_frame_rate(np.array(times)) is None
