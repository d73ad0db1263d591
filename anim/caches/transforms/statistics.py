"""Bounding box of the motion in a cache, and spacing of its frames."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.model import VertexCache

GRID_TOLERANCE_FRAMES = 1e-3  # fraction of a step by which a frame may deviate from the grid


def bounds(cache: VertexCache) -> tuple[Floats, Floats]:
    """Return the minimum and maximum x, y, z (3,) of all vertices of all frames; 0 without vertices.

    The cache is read in one pass.
    """
    least, most = np.full(3, np.inf), np.full(3, -np.inf)
    for chunk in cache.chunks():
        least = np.minimum(least, chunk.positions.min(axis=(0, 1), initial=np.inf))
        most = np.maximum(most, chunk.positions.max(axis=(0, 1), initial=-np.inf))
    return (least, most) if (least <= most).all() else (np.zeros(3), np.zeros(3))


def diagonal(cache: VertexCache) -> float:
    """Return the diagonal of the bounding box of the whole motion, in metres."""
    least, most = bounds(cache)
    return float(np.linalg.norm(most - least))


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
