"""The Hermite cubic against scipy's, against its own differences, and against the format's basis."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from anim.maths import hermite

RNG = np.random.default_rng(7)
P0, M0, P1, M1 = RNG.normal(size=(4, 3))
U = np.linspace(0, 1, 101)[:, None]


def test_agrees_with_scipy() -> None:
    spline = CubicHermiteSpline([0, 1], np.stack((P0, P1)), np.stack((M0, M1)))
    for ours, order in ((hermite.evaluate, 0), (hermite.first_derivative, 1), (hermite.second_derivative, 2)):
        np.testing.assert_allclose(ours(U, P0, M0, P1, M1), spline(U[:, 0], order), atol=1e-13)


def test_meets_ends_exactly() -> None:
    ends = np.array([[0.0], [1.0]])
    np.testing.assert_array_equal(hermite.evaluate(ends, P0, M0, P1, M1), np.stack((P0, P1)))
    np.testing.assert_array_equal(hermite.first_derivative(ends, P0, M0, P1, M1), np.stack((M0, M1)))


def test_smoothstep_by_hand() -> None:
    zero, one = np.zeros(1), np.ones(1)
    np.testing.assert_allclose(hermite.evaluate(U, zero, zero, one, zero), 3 * U**2 - 2 * U**3, atol=1e-15)
    np.testing.assert_array_equal(
        hermite.second_derivative(np.array([0.0, 0.5, 1.0]), zero, zero, one, zero), [6, 0, -6]
    )
