"""Estimation of the frame rate of keys."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats

USUAL_FPS = np.array([10, 12, 15, 20, 24000 / 1001, 24, 25, 30000 / 1001, 30, 48, 50, 60, 90, 100, 120, 240.0])  # fps
GRID_TOLERANCE_FRAMES = 0.02  # frames; key times that exporters store as float32 are far closer
MIN_REGULAR_FRACTION = 0.98  # minimum fraction of keys on the grid of a rate


class FrameRate(NamedTuple):
    """Estimated frame rate. fps: the estimate. regular: fraction of keys on its grid, 0 … 1."""

    fps: float
    regular: float


def estimate_frame_rate(times: Floats) -> FrameRate | None:
    """Return the frame rate of key times (K,) in seconds, increasing; None for too few keys.

    For evenly spaced keys the inverse of their spacing. Otherwise the slowest usual rate with nearly all keys on its
    grid; if there is none, the inverse of the median spacing.
    estimate_frame_rate([0, 0.25, 0.5, 1]) → 12 fps, not 4: if a key is missing, only usual rates are tried
    """
    if len(times) < 3:
        return None
    steps = np.diff(times)
    typical = _median(steps)
    if (
        len(times) > 4 and steps[-1] < (1 - GRID_TOLERANCE_FRAMES) * typical
    ):  # the end of a clip may be between two frames
        times, steps = times[:-1], steps[:-1]
    if (np.abs(steps - typical) < GRID_TOLERANCE_FRAMES * typical).all():
        fps = _round_rate((len(times) - 1) / float(times[-1] - times[0]))
        return FrameRate(fps, float(_regular(times, np.array([fps]))[0]))
    regular = _regular(times, USUAL_FPS)
    good = np.flatnonzero(regular >= MIN_REGULAR_FRACTION)
    if len(good):
        return FrameRate(float(USUAL_FPS[good[0]]), float(regular[good[0]]))
    fps = _round_rate(1 / typical)
    return FrameRate(fps, float(_regular(times, np.array([fps]))[0]))


def usual_frame_rate(times: Floats, min_fps: float) -> float | None:
    """Return the slowest usual rate, at least `min_fps`, with all key times (K,) on its grid, else None."""
    rates = USUAL_FPS[min_fps <= USUAL_FPS]
    good = np.flatnonzero(_regular(times, rates) == 1)
    return float(rates[good[0]]) if len(good) else None


def _median(values: Floats) -> float:
    """Median; np.median would import the masked arrays, which takes longer than all estimates of a file."""
    ordered = np.sort(values)
    return float(ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2]) / 2


def _regular(times: Floats, rates: Floats) -> Floats:
    """Fraction of the key times on the grid of each rate."""
    return np.array([_share_on_grid((times - times[0]) * rate) for rate in rates])


def _share_on_grid(frames: Floats) -> float:
    return float((np.abs(frames - np.rint(frames)) < GRID_TOLERANCE_FRAMES).mean())


def _round_rate(fps: float) -> float:
    """The usual or whole rate within a thousandth of the estimate, else the estimate."""
    near = np.concatenate((USUAL_FPS, [np.rint(fps)]))
    best = float(near[np.argmin(np.abs(near - fps))])
    return best if best > 0 and abs(best - fps) < 1e-3 * fps else fps
