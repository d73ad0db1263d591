"""Counts and times of steps."""

from __future__ import annotations

import numpy as np
import pytest

from anim.errors import RangeError, UnsupportedError
from anim.memory import memory_limit
from anim.simulation.steps import Steps, count_substeps


def test_steps_are_counted_by_integers() -> None:
    steps = Steps(1 / 240, 10.0, 0.5)
    assert (steps.num_steps, steps.num_warm_up_steps) == (2400, 120)
    assert steps.times()[-1] == 2400 / 240
    assert Steps(0.3, 1.0).num_steps == 4
    np.testing.assert_array_equal(Steps(0.1, 1.0).frames(4), [0, 0.25, 0.5, 0.75, 1])


@pytest.mark.parametrize(
    "values", [(0.0, 1.0), (-1.0, 1.0), (0.1, -1.0), (np.nan, 1.0), (0.1, np.inf), (1e-9, 1e9), (1e308, 1.0)]
)
def test_steps_without_sense_are_refused(values: tuple[float, float]) -> None:
    with pytest.raises((RangeError, UnsupportedError)):
        Steps(*values)


def test_steps_and_frames_count_for_the_limit_of_memory() -> None:
    steps = Steps(0.1, 10.0)
    with memory_limit(1000):
        steps.check_memory("2 joints", step_bytes=5, fps=2.0, frame_bytes=20)  # 101 steps, 21 frames
        with pytest.raises(UnsupportedError, match=r"10 s of 2 joints would take 1\.03e-06 GB or more"):
            steps.check_memory("2 joints", step_bytes=6, fps=2.0, frame_bytes=20)
    with pytest.raises(RangeError, match="`fps` is 0"):
        steps.check_memory("2 joints", fps=0.0)


@pytest.mark.parametrize(
    ("fps", "step", "count"), [(60, 1 / 240, 4), (60, 1 / 60, 1), (60, 1 / 100, 2), (60, 5.0, 1), (1e308, 1e308, 1)]
)
def test_the_substeps_of_a_frame_are_the_fewest_that_are_short_enough(fps: float, step: float, count: int) -> None:
    assert count_substeps(fps, step) == count


@pytest.mark.parametrize(("fps", "step"), [(60, 1e-320), (1e-308, 1e-308), (60, 1e-9), (1e-300, 1.0)])
def test_too_many_substeps_are_refused(fps: float, step: float) -> None:
    with pytest.raises(UnsupportedError, match=r"more than 10000000 steps of .* s in a frame"):
        count_substeps(fps, step)
    with pytest.raises(RangeError):
        count_substeps(fps, 0.0)
