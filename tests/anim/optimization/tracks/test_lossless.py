"""Keys that change nothing, left out: the same values at any time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import FLOAT32, Interpolation, Track
from anim.optimization.tracks.key_reduction import INT16, reduce_lossless
from anim.sampling.track import sample
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, track


def _held(rng: np.random.Generator, width: int, count: int) -> Floats:
    """Float32 values that often stay the same for some keys."""
    values = rng.normal(size=(count, width)).astype(np.float32).astype(np.float64)
    return np.asarray(values[np.maximum.accumulate(np.where(rng.random(count) < 0.4, np.arange(count), 0))])


def _random(seed: int, path: str, mode: Interpolation) -> Track:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 20))
    width = {"rotation": 4, "weights": 5}.get(path, 3)
    values = _held(rng, width, count)
    if path == "rotation":
        values = quaternion.normalize(values).astype(np.float32).astype(np.float64)
    times = np.cumsum(rng.uniform(0.01, 1, count)).astype(np.float32).astype(np.float64)
    tangents = None
    if mode is CUBICSPLINE:
        flat = np.zeros((count, width))
        tangents = (flat, flat) if rng.random() < 0.5 else (rng.normal(size=flat.shape), flat)
    return track(path, times, values, mode, tangents=tangents)


@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["translation", "rotation", "weights"]),
    st.sampled_from([LINEAR, STEP, CUBICSPLINE]),
)
def test_the_same_at_a_thousand_times(seed: int, path: str, mode: Interpolation) -> None:
    before = _random(seed, path, mode)
    after = reduce_lossless(before)
    at = np.random.default_rng(seed).uniform(-1, before.times[-1] + 1, 1000)
    at = np.concatenate((at, before.times, np.nextafter(before.times, -np.inf)))
    assert np.abs(sample(after, at) - sample(before, at)).max() < 1e-12
    assert len(after.times) <= len(before.times)
    assert set(after.times) <= set(before.times)
    assert mode is CUBICSPLINE or after.interpolation is mode


@pytest.mark.parametrize(
    ("mode", "values", "kept"),
    [
        (LINEAR, [1, 1, 1, 1], [0]),
        (LINEAR, [1, 1, 2, 2], [1, 2]),  # players hold the ends
        (LINEAR, [0, 1, 1, 1, 2], [0, 1, 3, 4]),
        (LINEAR, [0, 1, 2, 3], [0, 1, 2, 3]),  # on a line, but rounded: left to the search
        (STEP, [1, 1, 2, 2, 1], [0, 2, 4]),
        (STEP, [3, 3], [0]),
        (LINEAR, [5], [0]),
    ],
)
def test_which_keys_stay(mode: Interpolation, values: list[float], kept: list[int]) -> None:
    found = reduce_lossless(
        track("translation", np.arange(len(values)), np.repeat(np.array(values)[:, None], 3, axis=1), mode)
    )
    assert found.times.tolist() == kept
    assert found.interpolation is mode


def test_a_spline_at_rest_becomes_one_key() -> None:
    flat = np.zeros((3, 3))
    found = reduce_lossless(track("scale", [0, 1, 2], np.ones((3, 3)), CUBICSPLINE, tangents=(flat, flat)))
    assert (found.interpolation, found.times.tolist(), found.values.tolist()) == (LINEAR, [0], [[1, 1, 1]])
    assert found.in_tangents is None


def test_a_resting_turn_stays_a_spline_where_float32_made_it_too_long() -> None:
    """Players normalize splines; a single key some show as it is stored."""
    flat = np.zeros((3, 4))
    turn = np.tile(about("x", 37).astype(np.float32).astype(np.float64), (3, 1))
    assert np.linalg.norm(turn[0]) != 1
    found = reduce_lossless(track("rotation", [0, 1, 2], turn, CUBICSPLINE, tangents=(flat, flat)))
    assert (found.interpolation, found.times.tolist()) == (CUBICSPLINE, [0, 2])
    unit = reduce_lossless(
        track("rotation", [0, 1, 2], np.tile([0, 0, 0, 1.0], (3, 1)), CUBICSPLINE, tangents=(flat, flat))
    )
    assert (unit.interpolation, unit.times.tolist()) == (LINEAR, [0])


def test_a_moving_spline_is_left_alone() -> None:
    slopes = np.eye(3)
    before = track("scale", [0, 1, 2], np.ones((3, 3)), CUBICSPLINE, tangents=(slopes, 0 * slopes))
    assert reduce_lossless(before) is before


def test_int16_where_it_holds_every_value() -> None:
    turns = np.array([[0, 0, 0, 1.0], [1, 0, 0, 0], [0, -1, 0, 0]])
    before = track("rotation", [0, 1, 2], turns)
    assert reduce_lossless(before).storage == INT16
    assert reduce_lossless(replace(before, values=about("x", [0, 1, 2]))).storage == FLOAT32
    assert reduce_lossless(track("translation", [0, 1], np.eye(3)[:2])).storage == FLOAT32
