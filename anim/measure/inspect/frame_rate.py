"""At which frame rate were these keys made?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats

RATES = np.array([10, 12, 15, 20, 24000 / 1001, 24, 25, 30000 / 1001, 30, 48, 50, 60, 90, 100, 120, 240.0])  # fps
ON_GRID = 0.02  # frames; keys written as float32 by careful exporters are far closer
ENOUGH = 0.98  # share of keys that must lie on a rate's grid for it to be the rate


@dataclass(frozen=True, slots=True)
class FrameRate:
    """fps: the estimate. regular: share of the keys that lie on its grid, 0 … 1."""

    fps: float
    regular: float


def estimate_frame_rate(times: Floats) -> FrameRate | None:
    """Return the frame rate of key times (K,) in seconds, increasing; None where too few keys leave it open.

    Keys at one distance give its inverse. Otherwise the slowest usual rate that nearly all keys lie on; failing that,
    the inverse of the median distance.
    estimate([0, 0.25, 0.5, 1]) → 12 fps, not 4: only usual rates are tried where a key is missing
    """
    if len(times) < 3:
        return None
    steps = np.diff(times)
    typical = _median(steps)
    if len(times) > 4 and steps[-1] < (1 - ON_GRID) * typical:  # a clip may end between two frames
        times, steps = times[:-1], steps[:-1]
    if (np.abs(steps - typical) < ON_GRID * typical).all():
        fps = _round_rate((len(times) - 1) / float(times[-1] - times[0]))
        return FrameRate(fps, float(_regular(times, np.array([fps]))[0]))
    regular = _regular(times, RATES)
    good = np.flatnonzero(regular >= ENOUGH)
    if len(good):
        return FrameRate(float(RATES[good[0]]), float(regular[good[0]]))
    fps = _round_rate(1 / typical)
    return FrameRate(fps, float(_regular(times, np.array([fps]))[0]))


def _median(values: Floats) -> float:
    """The median (np.median loads the masked arrays, which takes longer than all estimates of a file)."""
    ordered = np.sort(values)
    return float(ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2]) / 2


def _regular(times: Floats, rates: Floats) -> Floats:
    frames = (times - times[0])[None] * rates[:, None]
    share: Floats = (np.abs(frames - np.rint(frames)) < ON_GRID).mean(axis=1)
    return share


def _round_rate(fps: float) -> float:
    """A usual or whole rate where the estimate is within a thousandth of one."""
    near = np.concatenate((RATES, [np.rint(fps)]))
    best = float(near[np.argmin(np.abs(near - fps))])
    return best if best > 0 and abs(best - fps) < 1e-3 * fps else fps
