"""Soles on the floor: what heights hips lose, in cases worked by hand."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.exchange.retarget.ground_contact import ground_offset

TIMES = np.arange(121) / 60
HEAD = np.full(121, 1.0)


def _steps(left: float, right: float, lift: float = 0.2) -> Floats:
    """Heights (F, 3) of a left foot, a right foot and a head: half a second on one foot, then on the other."""
    on_left = (TIMES * 2).astype(int) % 2 == 0
    return np.stack((np.where(on_left, left, left + lift), np.where(on_left, right + lift, right), HEAD), axis=-1)


def _lowered(source: Floats, target: Floats, scale: float = 1.0) -> Floats:
    feet = [np.array([0]), np.array([1])]
    return ground_offset(TIMES, source, feet, target, 0.0, scale)


@pytest.mark.parametrize("uneven", [0.0, 0.02, 0.035])
def test_feet_on_uneven_grounds_both_stand(uneven: float) -> None:
    """Soles 5 cm too high are 5 cm too high, also while the source stands on the foot that was measured too high."""
    soles = np.full((len(TIMES), 1), 0.05)
    np.testing.assert_allclose(_lowered(_steps(0.0, uneven), soles), 0.05, atol=1e-9)


def test_what_recordings_are_unsure_of_is_no_height() -> None:
    """A standing source that drifts by 1.2 % of its height: the soles that drift with it are put back."""
    drift = 0.006 * (1 + np.sin(np.pi * TIMES))
    source = np.stack((drift, drift + 0.3, HEAD), axis=-1)
    np.testing.assert_allclose(_lowered(source, drift[:, None]), drift, atol=5e-4)


def test_jumps_keep_their_height() -> None:
    """Half a second in the air, by a parabola 30 cm high; the target is half as tall and hangs 10 cm too high."""
    flight = np.maximum(0.0, 0.3 - 4.8 * (TIMES - 1) ** 2)
    source = np.stack((flight, flight, HEAD + flight), axis=-1)
    lowered = _lowered(source, 0.5 * flight[:, None] + 0.1, scale=0.5)
    middle = np.abs(TIMES - 1) < 0.15
    np.testing.assert_allclose(lowered[middle], 0.1, atol=2e-3)
    np.testing.assert_allclose(lowered[np.abs(TIMES - 1) > 0.35], 0.1, atol=1e-9)
