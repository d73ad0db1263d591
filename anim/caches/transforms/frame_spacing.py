"""Whether frames come at even steps, which numbered files and rows of pixels can't say by themselves."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats

EVEN = 1e-3  # share of a step by which frames may be off their grid


def frame_spacing(times: Floats) -> tuple[float, Floats]:
    """Return the step in seconds of at least two frames, and by how many steps each (F,) is off its grid.

    The last frame doesn't count for the step: at a clip's end it may come early.
    """
    step = float(times[1] - times[0])
    if len(times) > 2 and round(float(times[-2] - times[0]) / step) == len(times) - 2:
        step = float(times[-2] - times[0]) / (len(times) - 2)  # rounding of the first step would add up
    return step, np.abs(times - times[0] - step * np.arange(len(times))) / step


def notes(times: Floats) -> tuple[str, ...]:
    """Return what the user of files that only count frames should know, a line each; nothing where steps are even."""
    if len(times) < 3:
        return ()
    _, off = frame_spacing(times)
    steps = np.diff(times)
    if off[:-1].max() > EVEN:
        return (f"frames are not evenly spaced: {steps.min():.3g} … {steps.max():.3g} s apart; --fps spaces them",)
    return (last_frame_note(times, off),) if off[-1] > EVEN else ()


def last_frame_note(times: Floats, off: Floats) -> str:
    """Return the words for a last frame that is off the grid."""
    return f"the last frame is at {times[-1]:.4g} s, {off[-1]:.2g} steps off"
