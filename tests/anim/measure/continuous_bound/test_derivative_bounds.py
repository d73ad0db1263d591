"""Products of majorants, against motions whose derivatives are known."""

from __future__ import annotations

import numpy as np

from anim.measure.continuous_bound.derivative_bounds import derivative_bound, product, resting


def test_a_product_by_hand() -> None:
    """(2 + 3t + 4t²/2)(5 + 6t + 7t²/2) and the same with 1, 1, 1 added to the first: by Leibniz' rule."""
    a = derivative_bound(np.array([2.0, 3, 4]), np.array([1.0, 1, 1]))
    b = derivative_bound(np.array([5.0, 6, 7]), np.zeros(3))
    assert product(a, b)[:, 0].tolist() == [10, 27, 4 * 5 + 2 * 3 * 6 + 2 * 7]
    assert (product(a, b)[:, 1] - product(a, b)[:, 0]).tolist() == [5, 11, 5 + 2 * 6 + 7]


def test_what_rests_has_no_derivatives() -> None:
    found = resting(np.array([2.0]), 0.5)
    assert found[:, 0, 0].tolist() == [2, 0, 0]
    assert found[:, 1, 0].tolist() == [2.5, 0, 0]


def test_differences_of_products() -> None:
    """x = sin(ωt)·u and y = cos(νt)·v beside others a little faster: |Δ(x·y)″| on a fine grid stays below."""
    t = np.linspace(0, 1, 20_001)
    ones = [np.sin(3 * t), np.sin(3.01 * t), np.cos(5 * t), np.cos(5.02 * t)]
    jets = [np.stack((x, np.gradient(x, t), np.gradient(np.gradient(x, t), t)))[:, 5:-5] for x in ones]
    bounds = [
        derivative_bound(np.abs(first).max(axis=1), np.abs(second - first).max(axis=1))
        for first, second in (jets[:2], jets[2:])
    ]
    found = product(*bounds)
    second = np.gradient(np.gradient(ones[1] * ones[3] - ones[0] * ones[2], t), t)[5:-5]
    assert np.abs(second).max() <= found[2, 1] - found[2, 0] <= 4 * np.abs(second).max()
