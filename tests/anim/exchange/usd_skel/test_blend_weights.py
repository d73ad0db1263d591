"""Blend shapes with weights in 0 … 1 move as the morph targets do, at frames and between."""

from __future__ import annotations

import numpy as np
import pytest

from anim.exchange.usd_skel.blend_weights import scale_targets

CASES = [
    ([0, 0.5, 1], [1.0]),
    ([0.25, 2], [2.0]),
    ([0, -0.5], [-1.0]),
    ([-1, -3], [-3.0]),
    ([-1, 3], [3.0, -1.0]),
    ([2, -3, 0], [2.0, -3.0]),
    ([0, 0], [1.0]),
    ([-1e-8, 1 + 1e-7], [1.0]),
]


@pytest.mark.parametrize(("weights", "factors"), CASES)
def test_weights_of_a_target(weights: list[float], factors: list[float]) -> None:
    column = np.array(weights, float)
    found = scale_targets(column[:, None])
    assert [each.factor for each in found] == factors
    shown = np.stack([each.weights for each in found])
    assert shown.min() >= -1e-6
    assert shown.max() <= 1 + 1e-6
    middle = (shown[:, :-1] + shown[:, 1:]) / 2
    assert np.array(factors) @ shown == pytest.approx(column)
    assert np.array(factors) @ middle == pytest.approx((column[:-1] + column[1:]) / 2)


def test_targets_keep_their_order() -> None:
    found = scale_targets(np.array([[0, -1, 0.5], [1, 2, 0]]))
    assert [each.target for each in found] == [0, 1, 1, 2]
    assert scale_targets(np.zeros((3, 0))) == []
