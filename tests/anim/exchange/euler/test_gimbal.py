"""The gimbal report against numbers worked by hand and an independent Jacobian."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.exchange.euler import gimbal
from anim.exchange.euler.curve import linear
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.gimbal import GimbalStats, gimbal_stats
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, EulerNode, Pivots
from anim.maths import euler, quaternion
from anim.maths.euler import ORDERS, AxesConvention, is_proper

TIMES = np.arange(181) / 60


def _row(
    angles: tuple[float, float, float],
    order: str = "ZXY",
    frame: AxesConvention = AxesConvention.INTRINSIC,
    pivots: Pivots = NO_PIVOTS,
) -> GimbalStats:
    curves = tuple(linear(TIMES, np.linspace(0, np.radians(a), len(TIMES))) for a in angles)
    motion = EulerMotion((EulerNode("a", -1, np.zeros(3), order, frame, np.zeros(3), curves, pivots=pivots),))
    return gimbal_stats(motion, from_euler(motion, tolerance=1e-3).clip)[0]


def test_a_motion_up_to_two_degrees_from_lock() -> None:
    row = _row((0, 88, 0))
    assert row.nearest_deg == pytest.approx(2, abs=1e-3)
    assert row.at_s == pytest.approx(3)
    assert row.near_s == pytest.approx(3 * 3 / 88, abs=1 / 60)
    assert row.aligned == "Z and Y"
    assert row.best_order != "ZXY"
    assert row.best_nearest_deg > 80


@pytest.mark.parametrize("order", [order for order in ORDERS if not is_proper(order)])
@pytest.mark.parametrize("frame", AxesConvention)
def test_the_condition_is_that_of_the_jacobian(order: str, frame: AxesConvention) -> None:
    """Axes of the rates at the last frame: the singular values of the matrix that they are columns of."""
    row = _row((20, 80, -30), order, frame)
    a, b, c = np.eye(3)[["XYZ".index(x) for x in (order if frame == AxesConvention.INTRINSIC else order[::-1])]]
    middle = np.radians(80)
    turned = c * np.cos(middle) + np.cross(b, c) * np.sin(middle)
    values = np.linalg.svd(np.stack((a, b, turned), axis=1), compute_uv=False)
    assert row.worst_condition == pytest.approx(values[0] / values[2], rel=1e-3)


def test_lock_between_few_keys_is_found() -> None:
    """Keys at 0° and 120°, lock at 90°."""
    times = np.array((0.0, 1.0))
    curves = (None, linear(times, np.radians((0.0, 120.0))), None)
    motion = EulerMotion((EulerNode("a", -1, np.zeros(3), "XYZ", AxesConvention.INTRINSIC, np.zeros(3), curves),))
    clip = from_euler(motion, tolerance=1e-3).clip
    assert len(clip.tracks[0].times) == 2
    row = gimbal_stats(motion, clip)[0]
    assert row.nearest_deg < 2.1
    assert row.at_s == pytest.approx(0.75, abs=0.02)


def test_an_order_that_is_best_already_stays() -> None:
    assert _row((10, 0, 0), "ZXY").best_order == "ZXY"


def test_proper_orders_lock_at_zero() -> None:
    row = _row((0, 30, 0), "ZXZ")
    assert row.nearest_deg == pytest.approx(0, abs=1e-6)
    assert row.aligned == "both Z"


def test_the_best_extrinsic_order_is_the_intrinsic_one_backwards() -> None:
    inner, outer = _row((0, 88, 0), "ZXY"), _row((0, 88, 0), "YXZ", AxesConvention.EXTRINSIC)
    assert outer.best_order == inner.best_order[::-1]
    assert outer.best_order != outer.best_order[::-1]


@pytest.mark.parametrize("frame", AxesConvention)
def test_pre_and_post_rotations_are_no_part_of_the_angles(frame: AxesConvention) -> None:
    """80° of the middle angle are 10° from lock, whatever stands around the three turns."""
    turns = quaternion.normalize(np.random.default_rng(4).normal(size=(2, 4)))
    row = _row((30, 80, -20), "ZXY", frame, Pivots(*turns))
    assert row.nearest_deg == pytest.approx(10, abs=1e-3)
    assert row.at_s == pytest.approx(3)
    assert row.best_nearest_deg == pytest.approx(_row((30, 80, -20), "ZXY", frame).best_nearest_deg, abs=0.01)


def test_the_first_of_equal_times_counts() -> None:
    """A turn about one axis is a quarter from lock all the time, to within rounding."""
    turns = quaternion.normalize(np.random.default_rng(4).normal(size=(2, 4)))
    assert _row((720, 0, 0), "ZXY", pivots=Pivots(*turns)).at_s == 0


def test_distances_of_other_orders_are_computed_where_they_may_be_least(monkeypatch: pytest.MonkeyPatch) -> None:
    """The least ones are those of all rotations, bit for bit, from few of them."""
    sizes: list[int] = []

    def counted(q: Floats, *, order: str) -> Floats:
        sizes.append(len(q))
        return distance(q, order=order)

    distance = euler.gimbal_distance
    random = np.random.default_rng(4)
    curves = tuple(linear(TIMES, random.normal(0, 2, len(TIMES))) for _ in range(3))
    node = EulerNode("a", -1, np.zeros(3), "ZXY", AxesConvention.INTRINSIC, np.zeros(3), curves)
    motion = EulerMotion((node,))
    clip = from_euler(motion, tolerance=1e-3).clip
    monkeypatch.setattr(euler, "gimbal_distance", counted)
    row = gimbal_stats(motion, clip)[0]
    assert sorted(sizes)[-2] < max(sizes) / 100
    monkeypatch.setattr(gimbal, "COSINE_ROUNDING", 2.0)  # all rotations
    assert gimbal_stats(motion, clip)[0] == row
