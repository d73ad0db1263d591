"""Fitted keys, against numpy's least squares and scipy's minimization."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation, Slerp

from anim.arrays import Floats, Ints
from anim.maths import quaternion
from anim.optimization.search import key_fit
from anim.optimization.search.key_fit import MAX_UNBANDED_KEYS, KeyFit
from anim.optimization.search.key_intervals import KeyIntervals
from anim.optimization.search.stacked_clips import END_WEIGHT
from tests.calls import count_calls

RNG = np.random.default_rng(17)
AT = np.linspace(0, 2.5, 41)
KEYS = AT[[0, 13, 16, 40]]
WEIGHTS = np.r_[END_WEIGHT, np.ones(39), END_WEIGHT]
# of five axes: four keys, two, every time, late ones, and those of a clip of 20 times
PLACES = ([0, 13, 16, 40], [7, 31], list(range(41)), [5, 6, 30], [0, 3, 4, 11, 19])
AXIS_OF = np.array([2, 0, 4, 1, 0, 3, 4, 2])


def _intervals(places: Sequence[Sequence[int]]) -> KeyIntervals:
    """Intervals of axes with keys at some of the times, by a loop over axes and times."""
    counts = np.array([len(each) for each in places])
    at = np.array([[*each, *[each[-1]] * (counts.max() - len(each))] for each in places])
    left, u = np.zeros((len(places), 41), np.int64), np.zeros((len(places), 41))
    for a, each in enumerate(places):
        for w in range(41):
            left[a, w] = k = min(max(sum(place <= w for place in each) - 1, 0), max(len(each) - 2, 0))
            if len(each) > 1:
                u[a, w] = np.clip((AT[w] - AT[each[k]]) / (AT[each[k + 1]] - AT[each[k]]), 0, 1)
    return KeyIntervals(counts, at, left, u)


def _weights() -> Floats:
    """Weights (A, 41) of the axes' times: 0 after the end of the shorter clip."""
    weights = np.tile(WEIGHTS, (len(PLACES), 1))
    weights[-1] = np.r_[END_WEIGHT, np.ones(18), END_WEIGHT, np.zeros(21)]
    return weights


def _fit(places: Sequence[int] = PLACES[0]) -> KeyFit:
    """Least squares on one axis."""
    return KeyFit(_intervals([places]), WEIGHTS[None])


def _walks() -> Floats:
    """Values (2, T, 41) of all tracks."""
    return np.asarray(np.cumsum(RNG.normal(size=(2, len(AXIS_OF), 41)), axis=2))


def _lstsq(values: Floats, axis_of: Ints) -> list[Floats]:
    """The keys (C, K) of each track by numpy, one track after the other."""
    found = []
    for t, axis in enumerate(axis_of.tolist()):
        keys = AT[list(PLACES[axis])]
        hats = np.stack([np.interp(AT, keys, unit) for unit in np.eye(len(keys))], axis=1)
        root = np.sqrt(_weights()[axis])[:, None]
        found.append(np.linalg.lstsq(root * hats, root * values[:, t].T, rcond=None)[0].T)
    return found


@pytest.mark.parametrize("steps", [0, MAX_UNBANDED_KEYS])
def test_vectors_are_the_least_squares_of_numpy(steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of tracks on several axes, key by key and, with more keys than steps, by bands."""
    monkeypatch.setattr(key_fit, "MAX_UNBANDED_KEYS", steps)
    values = _walks()
    found = KeyFit(_intervals(PLACES), _weights()).vectors(values, AXIS_OF)
    assert found.shape == (2, len(AXIS_OF), 41)
    for t, expected in enumerate(_lstsq(values, AXIS_OF)):
        assert found[:, t, : expected.shape[1]] == pytest.approx(expected, abs=1e-9)


def test_tracks_together_have_the_keys_of_each_alone() -> None:
    values = _walks()
    together = KeyFit(_intervals(PLACES), _weights()).vectors(values, AXIS_OF)
    for t, axis in enumerate(AXIS_OF.tolist()):
        alone = KeyFit(_intervals(PLACES[axis : axis + 1]), _weights()[axis : axis + 1])
        found = alone.vectors(values[:, t : t + 1], np.zeros(1, np.int64))
        np.testing.assert_array_equal(together[:, t, : len(PLACES[axis])], found[:, 0])


def _cost(vectors: Floats, values: Floats) -> float:
    """Weighted squares of the angles to scipy's slerp of the keys with these rotation vectors (K · 3)."""
    shown = Slerp(KEYS, Rotation.from_rotvec(vectors.reshape(4, 3)))(AT)
    return float(WEIGHTS @ (shown.inv() * Rotation.from_quat(values)).magnitude() ** 2)


def _fit_rotations(values: Floats, keys: Floats) -> Floats:
    """Keys (K, 4) of one track, from values (W, 4) and first keys (K, 4)."""
    fitted = _fit().rotations(values.T[:, None], keys.T[:, None], np.zeros(1, np.int64))
    return np.asarray(fitted[:, 0].T)


def test_rotations_are_nearly_the_minimum_that_scipy_finds() -> None:
    axis = np.stack((np.sin(2 * AT), 0.7 * np.cos(3 * AT), 0.3 * AT), axis=1)
    values = Rotation.from_rotvec(0.6 * axis).as_quat()
    start = quaternion.align_signs(values[PLACES[0]])
    fitted = _fit_rotations(quaternion.align_signs(values), start)
    before, after = (_cost(Rotation.from_quat(keys).as_rotvec().ravel(), values) for keys in (start, fitted))
    best = minimize(_cost, Rotation.from_quat(start).as_rotvec().ravel(), args=(values,), method="BFGS").fun
    assert best < 0.7 * before
    assert best <= after * (1 + 1e-9) <= 1.02 * best
    assert np.linalg.norm(fitted, axis=1) == pytest.approx(np.ones(4))


@pytest.mark.parametrize("degrees", [43, 120])
def test_an_arc_stays_where_it_is(degrees: float) -> None:
    """A linear fit would move these keys, to make up for the chord that is shorter than the arc."""
    turns = Rotation.from_rotvec(np.radians(degrees) * KEYS[:, None] / 2.5 * [[0.6, 0, 0.8]])
    keys = turns.as_quat()
    assert _fit_rotations(Slerp(KEYS, turns)(AT).as_quat(), keys) == pytest.approx(keys, abs=1e-9)


def test_values_of_the_other_sign_are_the_same_rotations() -> None:
    values = Rotation.from_rotvec(AT[:, None] * [[0.3, 0.2, 0.4]]).as_quat()
    keys = Rotation.from_rotvec(KEYS[:, None] * [[0.3, 0.21, 0.4]]).as_quat()
    flips = np.where(RNG.random(41) < 0.5, -1.0, 1.0)[:, None]
    one, other = (_fit_rotations(each, keys) for each in (values, flips * values))
    assert np.abs(one - keys).max() > 1e-4
    assert one == pytest.approx(other, abs=1e-12)


def _turns() -> tuple[Floats, Floats]:
    """Rotations (4, T, 41) of all tracks, and their values at the keys (4, T, K)."""
    bends = 0.1 * np.cumsum(RNG.normal(size=(len(AXIS_OF), 41, 3)), axis=1)
    turns = np.stack([quaternion.align_signs(Rotation.from_rotvec(each).as_quat()) for each in bends])  # (T, 41, 4)
    values = np.ascontiguousarray(np.moveaxis(turns, 2, 0))
    at = _intervals(PLACES).at[AXIS_OF]
    return values, np.take_along_axis(values, np.broadcast_to(at, (4, *at.shape)), axis=2)


@pytest.mark.parametrize("steps", [0, MAX_UNBANDED_KEYS])
def test_rotations_together_have_the_keys_of_each_alone(steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(key_fit, "MAX_UNBANDED_KEYS", steps)
    values, keys = _turns()
    together = KeyFit(_intervals(PLACES), _weights()).rotations(values, keys, AXIS_OF)
    for t, axis in enumerate(AXIS_OF.tolist()):
        count = len(PLACES[axis])
        alone = KeyFit(_intervals(PLACES[axis : axis + 1]), _weights()[axis : axis + 1])
        found = alone.rotations(values[:, t : t + 1], keys[:, t : t + 1, :count], np.zeros(1, np.int64))
        assert together[:, t, :count] == pytest.approx(found[:, 0], abs=1e-14)


def test_long_axes_are_solved_by_bands_to_the_same_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    walks, (turns, start) = _walks(), _turns()
    fit = KeyFit(_intervals(PLACES), _weights())
    by_key = fit.vectors(walks, AXIS_OF), fit.rotations(turns, start, AXIS_OF)
    monkeypatch.setattr(key_fit, "MAX_UNBANDED_KEYS", 0)
    banded = count_calls(monkeypatch, KeyFit, "_solve_banded")
    by_bands = fit.vectors(walks, AXIS_OF), fit.rotations(turns, start, AXIS_OF)
    is_key = _intervals(PLACES).is_key[AXIS_OF]
    for a, b in zip(by_key, by_bands, strict=True):
        assert a[:, is_key] == pytest.approx(b[:, is_key], abs=1e-9)
    assert len(banded) == 2


def test_one_key_is_the_weighted_mean() -> None:
    """Of an axis by itself, and beside a longer one."""
    values = _walks()[:, :1]
    expected = (WEIGHTS * values[:, 0]).sum(axis=1) / WEIGHTS.sum()
    for places in ([[7]], [[7], [0, 40]]):
        fit = KeyFit(_intervals(places), np.tile(WEIGHTS, (len(places), 1)))
        assert fit.vectors(values, np.zeros(1, np.int64))[:, 0, 0] == pytest.approx(expected)


def test_no_axis_and_no_track() -> None:
    none = np.zeros(0, np.int64)
    empty = np.zeros((0, 1), np.int64)
    fit = KeyFit(KeyIntervals(none, empty, np.zeros((0, 41), np.int64), np.zeros((0, 41))), np.zeros((0, 41)))
    assert fit.vectors(np.zeros((3, 0, 41)), none).shape == (3, 0, 1)


def test_tracks_on_short_axes_beside_a_long_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of another track: the arrays are as long as that axis."""
    monkeypatch.setattr(key_fit, "MAX_UNBANDED_KEYS", 4)
    places = [[0, 20, 40], list(range(0, 41, 4))]
    values, weights = _walks()[:, :1], np.tile(WEIGHTS, (2, 1))
    together = KeyFit(_intervals(places), weights).vectors(values, np.zeros(1, np.int64))
    alone = KeyFit(_intervals(places[:1]), weights[:1]).vectors(values, np.zeros(1, np.int64))
    assert together[:, :, :3] == pytest.approx(alone, abs=1e-12)
