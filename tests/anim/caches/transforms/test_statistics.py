"""Uneven steps, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from anim.caches.transforms import statistics
from anim.model.vertex_cache import from_arrays
from tests.anim.caches.making import FACES, written


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ([0.0], ""),
        ([0.0, 0.7], ""),
        ([0.5, 0.75, 1.0, 1.25], ""),
        ([0.0, 0.1, 0.2, 0.4, 0.5], "frames are not evenly spaced: 0.1 … 0.2 s apart (a frame rate spaces them)"),
        ([0.0, 0.1, 0.2, 0.25], "the last frame is at 0.25 s, 0.5 steps off"),
        (np.round(np.arange(2000) / 29.97, 5).tolist(), ""),  # rounding of the first step doesn't add up
    ],
)
def test_notes(times: list[float], words: str) -> None:
    assert statistics.notes(np.array(times)) == ((words,) if words else ())


@pytest.mark.parametrize(("name", "is_said"), [("a.ply", 1), ("a.stl", 1), ("a.png", 1), ("a.npz", 0), ("a.mdd", 0)])
def test_formats_that_only_count_frames_say_it(name: str, is_said: int) -> None:
    times = np.array([0, 0.1, 0.5, 0.6])
    _, said = written(from_arrays(times, np.random.default_rng(1).normal(size=(4, 9, 3)), FACES), name)
    assert sum("not evenly spaced" in note for note in said.notes) == is_said
