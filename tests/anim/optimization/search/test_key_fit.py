"""Fitted keys, against numpy's least squares and scipy's minimization."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation, Slerp

from anim.arrays import Floats
from anim.maths import quaternion
from anim.optimization.search import key_fit
from anim.optimization.search.key_fit import END_WEIGHT, KeyFit
from anim.sampling.track import find_interval

RNG = np.random.default_rng(17)
KEYS = np.array([0.0, 0.8, 1.0, 2.5])
AT = np.linspace(0, 2.5, 41)
WEIGHTS = np.r_[END_WEIGHT, np.ones(39), END_WEIGHT]


def test_vectors_are_the_least_squares_of_numpy() -> None:
    values = np.cumsum(RNG.normal(size=(41, 3, 2)), axis=0)
    hats = np.stack([np.interp(AT, KEYS, unit) for unit in np.eye(4)], axis=1)
    root = np.sqrt(WEIGHTS)[:, None]
    expected = np.linalg.lstsq(root * hats, root * values.reshape(41, 6), rcond=None)[0].reshape(4, 3, 2)
    assert KeyFit(find_interval(KEYS, AT), 4).vectors(values) == pytest.approx(expected, abs=1e-9)


def _cost(vectors: Floats, values: Floats) -> float:
    """Weighted squares of the angles to scipy's slerp of the keys with these rotation vectors (K · 3)."""
    shown = Slerp(KEYS, Rotation.from_rotvec(vectors.reshape(4, 3)))(AT)
    return float(WEIGHTS @ (shown.inv() * Rotation.from_quat(values)).magnitude() ** 2)


def test_rotations_are_nearly_the_minimum_that_scipy_finds() -> None:
    axis = np.stack((np.sin(2 * AT), 0.7 * np.cos(3 * AT), 0.3 * AT), axis=1)
    values = Rotation.from_rotvec(0.6 * axis).as_quat()
    start = quaternion.align_signs(np.array([values[int(np.abs(AT - key).argmin())] for key in KEYS]))
    fitted = KeyFit(find_interval(KEYS, AT), 4).rotations(quaternion.align_signs(values)[:, None], start[:, None])[:, 0]
    before, after = (_cost(Rotation.from_quat(keys).as_rotvec().ravel(), values) for keys in (start, fitted))
    best = minimize(_cost, Rotation.from_quat(start).as_rotvec().ravel(), args=(values,), method="BFGS").fun
    assert best < 0.7 * before
    assert best <= after * (1 + 1e-9) <= 1.02 * best
    assert np.linalg.norm(fitted, axis=1) == pytest.approx(np.ones(4))


@pytest.mark.parametrize("degrees", [43, 120])
def test_an_arc_stays_where_it_is(degrees: float) -> None:
    """A linear fit would move these keys, to make up for the chord that is shorter than the arc."""
    turns = Rotation.from_rotvec(np.radians(degrees) * KEYS[:, None] / 2.5 * [[0.6, 0, 0.8]])
    values = Slerp(KEYS, turns)(AT).as_quat()
    keys = turns.as_quat()
    fitted = KeyFit(find_interval(KEYS, AT), 4).rotations(values[:, None], keys[:, None])[:, 0]
    assert fitted == pytest.approx(keys, abs=1e-9)


def test_values_of_the_other_sign_are_the_same_rotations() -> None:
    values = Rotation.from_rotvec(AT[:, None] * [[0.3, 0.2, 0.4]]).as_quat()
    keys = Rotation.from_rotvec(KEYS[:, None] * [[0.3, 0.21, 0.4]]).as_quat()
    flips = np.where(RNG.random(41) < 0.5, -1.0, 1.0)[:, None]
    one, other = (
        KeyFit(find_interval(KEYS, AT), 4).rotations(v[:, None], keys[:, None]) for v in (values, flips * values)
    )
    assert one == pytest.approx(other, abs=1e-12)


def test_long_clips_are_solved_by_bands_to_the_same_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.cumsum(RNG.normal(size=(41, 3, 2)), axis=0)
    turns = quaternion.align_signs(Rotation.from_rotvec(0.1 * np.cumsum(RNG.normal(size=(41, 3)), axis=0)).as_quat())
    start = turns[[0, 13, 16, 40]][:, None]
    dense = KeyFit(find_interval(KEYS, AT), 4)
    monkeypatch.setattr(key_fit, "MAX_DENSE_VALUES", 0)
    banded = KeyFit(find_interval(KEYS, AT), 4)
    assert banded.vectors(values) == pytest.approx(dense.vectors(values), abs=1e-9)
    assert banded.rotations(turns[:, None], start) == pytest.approx(dense.rotations(turns[:, None], start), abs=1e-12)
