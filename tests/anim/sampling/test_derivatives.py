"""Rates of change against central differences, on either side of keys."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.model import Track, ValueKind
from anim.sampling import derivatives
from anim.sampling.track import sample
from tests.anim.sampling.test_track import TIMES, TRACKS
from tests.clips import STEP, about, track

H = 1e-5  # s
BETWEEN = np.array([0.3, 0.4, 0.7, 1.1, 1.3, 2.0, 3.9])


@pytest.mark.parametrize("name", TRACKS)
@pytest.mark.parametrize("before", [True, False])
def test_between_keys_both_sides_are_the_central_difference(name: str, before: bool) -> None:
    found = derivatives.rates(TRACKS[name], BETWEEN, before=before)
    np.testing.assert_allclose(found, _difference(TRACKS[name], BETWEEN - H, BETWEEN + H), atol=1e-6)


@pytest.mark.parametrize("name", TRACKS)
def test_at_keys_the_sides_are_one_sided_differences(name: str) -> None:
    """Second order: the central difference half a step to the side, at two steps, towards none."""
    made = TRACKS[name]
    if len(made.times) == 1 or made.interpolation == STEP:
        pytest.skip("stands still")
    for before, side in ((True, -1), (False, 1)):
        near, far = (
            _difference(made, *sorted((TIMES, TIMES + side * step), key=lambda each: each[0])) for step in (H, 2 * H)
        )
        np.testing.assert_allclose(derivatives.rates(made, TIMES, before=before), 2 * near - far, atol=1e-5)


@pytest.mark.parametrize("name", TRACKS)
def test_outside_the_keys_all_stands_still(name: str) -> None:
    outside = np.array([-1.0, 0, 0.2, 4.1, 99])
    for before in (True, False):
        assert not derivatives.rates(TRACKS[name], outside, before=before).any()
    first, last = TIMES[:1], TIMES[-1:]
    assert not derivatives.rates(TRACKS[name], first, before=True).any()
    assert not derivatives.rates(TRACKS[name], last, before=False).any()


def test_a_steady_turn_by_hand() -> None:
    turn = track("rotation", [0, 2], [about("y", 0), about("y", 90)])
    expected = [[0, np.pi / 4, 0]]
    np.testing.assert_allclose(derivatives.rates(turn, np.array([1.0]), before=False), expected, atol=1e-15)
    flipped = track("rotation", [0, 2], [about("y", 0), -about("y", 90)])
    np.testing.assert_allclose(derivatives.rates(flipped, np.array([1.0]), before=False), expected, atol=1e-15)


@pytest.mark.parametrize("name", [name for name in TRACKS if TRACKS[name].kind is ValueKind.ROTATION])
def test_tangents_of_rotations_follow_the_values_sign_and_stand_at_a_right_angle(name: str) -> None:
    values = sample(TRACKS[name], BETWEEN)
    for sign in (1, -1):
        arriving, leaving = derivatives.tangents(TRACKS[name], BETWEEN, sign * values)
        np.testing.assert_allclose((leaving * values).sum(axis=1), 0, atol=1e-12)
        np.testing.assert_allclose(arriving, leaving, atol=1e-9)
        difference = (sample(TRACKS[name], BETWEEN + H) - sample(TRACKS[name], BETWEEN - H)) / (2 * H)
        np.testing.assert_allclose(leaving, sign * difference, atol=1e-6)


def test_tangents_of_vectors_are_their_rates() -> None:
    made = TRACKS["cubic vectors"]
    arriving, leaving = derivatives.tangents(made, TIMES, made.values)
    assert made.in_tangents is not None
    assert made.out_tangents is not None
    np.testing.assert_allclose(arriving[1:], made.in_tangents[1:], atol=1e-12)
    np.testing.assert_allclose(leaving[:-1], made.out_tangents[:-1], atol=1e-12)
    assert not arriving[0].any()
    assert not leaving[-1].any()


def _difference(made: Track, early: Floats, late: Floats) -> Floats:
    """The mean rate between two times; of rotations the angular velocity along the node's own axes, by scipy."""
    a, b = sample(made, early), sample(made, late)
    step = (late - early)[:, None]
    if made.kind is not ValueKind.ROTATION:
        return np.asarray((b - a) / step)
    return np.asarray((Rotation.from_quat(a).inv() * Rotation.from_quat(b)).as_rotvec() / step)
