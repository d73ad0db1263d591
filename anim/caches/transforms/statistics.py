"""Size of the model in a cache, and spacing of its frames."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.model import VertexCache

GRID_TOLERANCE_FRAMES = 1e-3  # fraction of a step by which a frame may deviate from the grid


def diagonal(cache: VertexCache) -> float:
    """Return the size of the model in metres: the diagonal of the bounding box of its rest pose.

    Without a rest pose, the largest diagonal of a frame. A figure that travels is as large as one that does not.
    """
    if cache.rest is not None and len(cache.rest):
        size = float(np.linalg.norm(np.ptp(np.asarray(cache.rest, np.float64), axis=0)))
        if size > 0:
            return size
    largest = 0.0
    for chunk in cache.chunks():
        if chunk.positions.shape[1]:
            spans = np.ptp(chunk.positions, axis=1).astype(np.float64)
            largest = max(largest, float(np.linalg.norm(spans, axis=1).max(initial=0.0)))
    return largest


def frame_spacing(times: Floats) -> tuple[float, Floats]:
    """Return the step in seconds of at least two frames, and the deviation of each (F,) in steps.

    The last frame is excluded from the step: at a clip's end it may be early.
    """
    step = float(times[1] - times[0])
    if len(times) > 2 and round(float(times[-2] - times[0]) / step) == len(times) - 2:
        step = float(times[-2] - times[0]) / (len(times) - 2)  # rounding of the first step would accumulate
    return step, np.abs(times - times[0] - step * np.arange(len(times))) / step


def notes(times: Floats) -> tuple[str, ...]:
    """Return notes for files that only count frames, a line each; none for even steps."""
    if len(times) < 3:
        return ()
    _, off = frame_spacing(times)
    steps = np.diff(times)
    if off[:-1].max() > GRID_TOLERANCE_FRAMES:
        return (
            f"frames are not evenly spaced: {steps.min():.3g} … {steps.max():.3g} s apart (a frame rate spaces them)",
        )
    return (last_frame_note(times, off),) if off[-1] > GRID_TOLERANCE_FRAMES else ()


def last_frame_note(times: Floats, off: Floats) -> str:
    """Return the note about a last frame with a deviation from the grid."""
    return f"the last frame is at {times[-1]:.4g} s, {off[-1]:.2g} steps off"
