"""Frames against seconds: the fence posts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anim.errors import RangeError, UnsupportedError
from anim.sampling.times import MAX_FRAMES, check_duration, frame_times, key_times


@pytest.mark.parametrize(
    ("start", "end", "fps", "frames"),
    [
        (0, 1, 4, [0, 0.25, 0.5, 0.75, 1]),
        (0, 0.6, 4, [0, 0.25, 0.5, 0.6]),
        (0, 0.2, 4, [0, 0.2]),
        (0, 0, 30, [0]),
        (5, 5, 30, [5]),
        (0.25, 1, 2, [0.25, 0.75, 1]),
        (2, 3, 1, [2, 3]),
        (0, 1, 0.5, [0, 1]),
        (0, 3, 0.5, [0, 2, 3]),
        (0, 1, 1, [0, 1]),
    ],
)
def test_by_hand(start: float, end: float, fps: float, frames: list[float]) -> None:
    assert frame_times(start, end, fps=fps).tolist() == frames


@pytest.mark.parametrize("fps", [24, 25, 29.97, 30, 60, 23.976])
@pytest.mark.parametrize("seconds", [0.5, 1.0, 10.0, 60.0])
def test_an_end_rounded_to_float32_gives_no_sliver_of_a_frame(fps: float, seconds: float) -> None:
    whole = round(seconds * fps)
    for nudge in (-np.inf, np.inf):
        end = float(np.nextafter(np.float32(whole / fps), np.float32(nudge)))
        times = frame_times(0, end, fps=fps)
        assert len(times) == whole + 1
        assert times[-1] == end
        assert np.diff(times).min() > 0.99 / fps


@given(start=st.floats(0, 1000, width=32), length=st.floats(0, 100, width=32), fps=st.floats(0.1, 240))
def test_frames_are_start_and_whole_numbers_of_steps_and_the_exact_end(start: float, length: float, fps: float) -> None:
    times = frame_times(start, start + length, fps=fps)
    assert times[0] == start
    assert times.tolist()[:-1] == [start + k / fps for k in range(len(times) - 1)]
    assert (np.diff(times) > 0).all()
    sliver = max(1e-3, 2 * float(np.spacing(np.float32(start + length))) * fps)  # what the last step may be longer by
    assert not len(times) > 1 or np.diff(times).max() <= (1.0001 + sliver) / fps + 1e-12 * start
    if length * fps > 1:
        assert times[-1] == start + length
    assert not times.flags.writeable


@pytest.mark.parametrize("fps", [0, -1, float("nan"), float("inf"), -float("inf")])
def test_a_rate_is_a_number_above_0(fps: float) -> None:
    with pytest.raises(RangeError, match="`fps` is"):
        frame_times(0, 1, fps=fps)


def test_more_frames_than_any_number_are_no_infinity() -> None:
    with pytest.raises(UnsupportedError, match=r"^too many frames at 1e\+308 fps \(limit 10000000\)"):
        frame_times(0, 10, fps=1e308)


def test_too_many_frames_are_refused_at_once() -> None:
    with pytest.raises(UnsupportedError, match="limit"):
        frame_times(0, 1, fps=MAX_FRAMES + 1)
    with pytest.raises(UnsupportedError, match="limit"):
        frame_times(0, 1e300, fps=1e300)


def test_a_clip_that_is_too_long_is_refused_as_a_rate_is() -> None:
    assert check_duration(1, MAX_FRAMES / 30 + 1, fps=30) == MAX_FRAMES
    with pytest.raises(UnsupportedError, match=r"1\.2e\+07 frames at 120 fps \(limit 10000000\)"):
        check_duration(0, 1e5, fps=120)
    with pytest.raises(UnsupportedError, match=r"too many frames at 60 fps \(limit 10000000\)"):
        check_duration(0, 1e308, fps=60)


def test_key_times_are_float32_and_distinct() -> None:
    found = key_times(np.array([0, 0.1, 1000, 1000.00001, 1000.001]))
    assert found.tolist() == [0, float(np.float32(0.1)), 1000, float(np.float32(1000.001))]
    assert found.dtype == np.float64
