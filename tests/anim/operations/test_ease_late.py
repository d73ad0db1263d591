"""Easings with vertical slopes on late clips, where float32 times are coarse: no key is far from the easing."""

from __future__ import annotations

import numpy as np
import pytest

from anim.curves.easing.table import parse
from anim.model import Clip, Track
from anim.operations.ease import ease
from anim.operations.time_warp import warp
from anim.sampling.track import sample

OFFSETS = np.array([0.0, 0.25, 0.5, 1.0, 1.5, 2.0])
STEEP = ("circ-in", "circ-out", "cubic-bezier(0,1,0,1)", "cubic-bezier(1,0,1,0)")


def clip(start: float) -> Clip:
    values = np.arange(6.0)[:, None] * [1.0, 0, 0]
    return Clip("late", (Track(0, "translation", "LINEAR", start + OFFSETS, values),))


def largest_error(track: Track, expected: np.ndarray, at: np.ndarray, reach: float) -> float:
    """Largest distance in x from the expected values, each free to lie `reach` seconds earlier or later."""
    found = sample(track, at)[:, 0]
    n = max(1, round(reach / (at[1] - at[0])))
    padded = np.pad(expected, n, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * n + 1)
    return float(np.maximum(windows.min(axis=1) - found, found - windows.max(axis=1)).max())


@pytest.mark.slow
@pytest.mark.parametrize("name", STEEP)
@pytest.mark.parametrize("start", [0.0, 60.0, 600.0, 7200.0])
def test_eased_segments_stay_near_the_easing_and_keep_the_keys(name: str, start: float) -> None:
    easing, old = parse(name), clip(start)
    track = ease(old, easing=easing).tracks[0]
    at = np.linspace(start, start + 2, 40001)
    keys = start + OFFSETS
    i = np.clip(np.searchsorted(keys, at, side="right") - 1, 0, 4)
    expected = i + easing.value((at - keys[i]) / (keys[i + 1] - keys[i]))
    reach = 2 * float(np.spacing(np.float32(start + 2))) + 5e-5
    assert largest_error(track, expected, at, reach) < 0.02
    np.testing.assert_allclose(sample(track, keys)[:, 0], np.arange(6), atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", STEEP)
@pytest.mark.parametrize("start", [0.0, 600.0, 7200.0])
def test_a_warped_range_stays_near_the_easing(name: str, start: float) -> None:
    easing, old = parse(name), clip(start)
    track = warp(old, easing=easing).tracks[0]
    at = np.linspace(start, start + 2, 40001)
    expected = np.interp(2 * easing.value((at - start) / 2), OFFSETS, np.arange(6.0))
    reach = 2 * float(np.spacing(np.float32(start + 2))) + 5e-5
    assert largest_error(track, expected, at, reach) < 0.06
