"""Steps of a simulation, against the frames of its output.

Both are counted by integers from the start: step n is at n · step, frame k at k / fps. Nothing is accumulated, so the
result does not depend on how long the simulation has run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError, UnsupportedError, check_number
from anim.memory import MemoryBudget
from anim.sampling.times import check_duration, check_fps, frame_times
from anim.simulation.limits import check_range

MAX_STEPS = 10_000_000
MAX_STEP_S = 1e6  # a larger one is a mistake, and its products with frequencies are not finite
FEWER_STEPS = "choose a shorter `duration`, or a longer `step`"
SHORTER = "choose a shorter `duration`, a lower `fps` or a longer `step`, or raise `memory_limit`"


@dataclass(frozen=True, slots=True)
class Steps:
    """Fixed steps of `step_s` seconds from −`warm_up_s` to at least `duration_s`; frames are written from 0 on.

    Raises RangeError for a step that isn't above 0, or above 10⁶ s, and negative lengths, UnsupportedError for over ten
    million steps.
    """

    step_s: float
    duration_s: float
    warm_up_s: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("step", self.step_s), ("duration", self.duration_s), ("warm_up", self.warm_up_s)):
            value = check_number(value, name)
            if not math.isfinite(value) or value < 0:
                raise RangeError(f"`{name}` is {value:g} s (expected {'above 0' if name == 'step' else 'at least 0'})")
        check_range("step", self.step_s, 0.0, MAX_STEP_S, "s", is_above=True)
        if (self.duration_s + self.warm_up_s) / self.step_s > MAX_STEPS:
            raise UnsupportedError(f"more than {MAX_STEPS} steps of {self.step_s:g} s", help=FEWER_STEPS)

    @property
    def num_steps(self) -> int:
        """Number of steps from 0 on."""
        return _count(self.duration_s / self.step_s)

    @property
    def num_warm_up_steps(self) -> int:
        """Number of steps before 0."""
        return _count(self.warm_up_s / self.step_s)

    def check_memory(self, who: str, *, step_bytes: int = 0, fps: float, frame_bytes: int = 0) -> None:
        """Raise UnsupportedError for more steps and frames than the limit of memory allows, before they are computed.

        who: has a state of `step_bytes` at each step from 0 on, and of `frame_bytes` at each frame.
        """
        check_fps(fps)
        num_frames = math.ceil(check_duration(0.0, self.duration_s, fps=fps)) + 1
        size = step_bytes * (self.num_steps + 1) + frame_bytes * num_frames
        MemoryBudget(0).check(size, f"{self.duration_s:g} s of {who}", help=SHORTER)

    def times(self) -> Floats:
        """Return the times of all steps from 0 on: (num_steps + 1,) s."""
        return np.arange(self.num_steps + 1, dtype=np.float64) * self.step_s

    def frames(self, fps: float) -> Floats:
        """Return the frame times (F,) s from 0 to the duration."""
        return frame_times(0.0, self.duration_s, fps=fps)


def count_substeps(fps: float, step: float) -> int:
    """Return the fewest equal steps of at most `step` s that a frame of `fps` per second has.

    Raises RangeError unless both are above 0, UnsupportedError for over ten million.
    count_substeps(60, 1 / 240) → 4
    """
    fps = check_fps(fps)
    check_range("step", step, 0.0, math.inf, "s", is_above=True)
    if not fps * step * MAX_STEPS >= 1:
        raise UnsupportedError(f"more than {MAX_STEPS} steps of {step:g} s in a frame", help="choose a longer `step`")
    return max(1, _count(1 / (fps * step)))


def _count(steps: float) -> int:
    """Whole number of steps that covers this many; a rounding error of 1e-9 steps doesn't add one."""
    return math.ceil(steps - 1e-9)
