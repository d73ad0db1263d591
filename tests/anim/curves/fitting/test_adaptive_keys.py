"""Adaptive keys, against closed forms: chords of a circle and of a parabola, jumps, and limits."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats, Ints
from anim.curves.fitting import adaptive_keys
from anim.curves.fitting.adaptive_keys import TrackFunction, cubic_keys, linear_keys, refine, segment_count
from anim.errors import UnsupportedError
from anim.maths import quaternion
from anim.model import Track

ENDS = np.array((0.0, 2.0))
MANY = np.linspace(0, 2, 4001)


def parabola(at: Floats, before: bool = False) -> Floats:
    return (at * at)[:, None]


def turn(at: Floats, before: bool = False) -> Floats:
    """Two turns about z, accelerated."""
    return quaternion.from_rotation_vector(np.stack((0 * at, 0 * at, np.pi * at * at), axis=1))


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3, 1e-5])
def test_chords_of_a_parabola(tolerance: float) -> None:
    """A chord over h is off by h² / 4, so 1 / √tolerance segments are the fewest; the safety factor adds 1 %."""
    times, values = linear_keys(TrackFunction(parabola, rotation=False), ENDS, tolerance=tolerance)
    assert np.abs(np.interp(MANY, times, values[:, 0]) - MANY**2).max() <= tolerance
    assert len(times) - 1 <= np.ceil(1.02 / np.sqrt(tolerance))
    np.testing.assert_array_equal(times, times.astype(np.float32))


def test_rotations_by_whole_turns_are_followed() -> None:
    """Samples alone would not see two whole turns between two keys; the bound of the travel does."""
    motion = TrackFunction(turn, rotation=True, travel=lambda a, b: np.pi * (b * b - a * a))
    times, values = linear_keys(motion, ENDS, tolerance=1e-3)
    steps = 2 * np.arccos(np.clip(quaternion.dot(values[1:], values[:-1]), -1, 1))
    assert steps.sum() == pytest.approx(4 * np.pi)
    assert np.degrees(steps.max()) <= 120.1
    assert (times[0], times[-1]) == (0, 2)


def test_a_jump_has_a_key_just_before_it() -> None:
    def square(at: Floats, before: bool) -> Floats:
        return np.where(at > 1 if before else at >= 1, 5.0, 0.0)[:, None]

    times, values = linear_keys(TrackFunction(square, rotation=False), np.array((0.0, 1.0, 2.0)), tolerance=1e-3)
    assert times.tolist() == [0, float(np.nextafter(np.float32(1), np.float32(0))), 1, 2]
    assert values[:, 0].tolist() == [0, 0, 5, 5]


def test_one_cubic_is_enough_for_a_parabola() -> None:
    track = Track(0, "weights", "LINEAR", ENDS, parabola(ENDS))
    motion = TrackFunction(parabola, rotation=False, rates=lambda at, before: 2 * at[:, None])
    made = cubic_keys(track, motion, ENDS, tolerance=1e-9)
    assert made.times.tolist() == [0, 2]
    assert made.in_tangents is not None
    assert made.in_tangents[-1].tolist() == [4]


def test_segments_are_counted_by_the_root_of_their_error() -> None:
    assert segment_count(np.array((0.0, 1.0, 1.1, 4.0, 1e9)), 1.0).tolist() == [1, 1, 2, 2, 64]


def test_too_many_keys_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adaptive_keys, "MAX_KEYS", 100)
    with pytest.raises(UnsupportedError, match="over 100 keys"):
        refine(ENDS, lambda a, b: np.full(len(a), 8))


def test_memory_is_that_of_a_block() -> None:
    sizes = []

    def count(a: Floats, b: Floats) -> Ints:
        sizes.append(len(a))
        return np.where(b - a > 1 / 64, 2, 1)

    assert refine(ENDS, count, block=10).tolist() == np.linspace(0, 2, 129).tolist()
    assert max(sizes) == 10
