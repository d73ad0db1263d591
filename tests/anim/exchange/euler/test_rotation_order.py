"""Orders of angles by joint: what is said, and what is best."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.errors import NotFoundError, RangeError
from anim.exchange.euler.rotation_order import AUTO, CANDIDATES, OrderRules, parse
from anim.maths import euler
from anim.maths.euler import AxesConvention

NONE = np.array([[0, 0, 0, 1.0]])


def _swing(axis: int, degrees: float) -> Floats:
    """Turns about one axis from −degrees to degrees."""
    angles = np.zeros((41, 3))
    angles[:, axis] = np.radians(np.linspace(-degrees, degrees, 41))
    return euler.to_quaternion(angles, order="XYZ")


def test_what_is_said_counts_in_turn() -> None:
    orders = parse("hips=zxy, *arm=Yzx,xyz")
    assert [orders.of(name, NONE) for name in ("hips", "left_arm", "head")] == ["ZXY", "YZX", "XYZ"]
    assert not orders.is_one
    assert parse("zyx").is_one
    assert parse("hips=ZYX").of("head", NONE) == "ZXY"


@pytest.mark.parametrize(
    ("text", "problem"), [("XXY", "`order` is 'XXY'"), ("a=", "`order` is ''"), ("XYZ,ZYX", "one for all")]
)
def test_what_is_none_is_refused(text: str, problem: str) -> None:
    with pytest.raises(RangeError, match=problem):
        parse(text)


def test_a_name_that_is_not_there_is_refused() -> None:
    with pytest.raises(NotFoundError, match="'hip=ZXY', but no node"):
        parse("hip=ZXY").check(["hips", "head"])


@pytest.mark.parametrize("axis", range(3))
def test_auto_keeps_the_widest_swing_out_of_the_middle(axis: int) -> None:
    """A middle angle of 90° is lock: the axis that swings by 89° must stand first or last."""
    order = OrderRules(AUTO).of("a", _swing(axis, 89))
    assert order[1] != "XYZ"[axis]
    assert np.degrees(euler.gimbal_distance(_swing(axis, 89), order=order).min()) > 85


def test_auto_is_the_best_of_six_by_trying() -> None:
    random = np.random.default_rng(5)
    turns = euler.to_quaternion(random.uniform(-1.2, 1.2, (60, 3)), order="YXZ")
    nearest = {order: euler.gimbal_distance(turns, order=order).min() for order in CANDIDATES}
    found = OrderRules(AUTO).of("a", turns)
    assert nearest[found] >= max(nearest.values()) - np.radians(1.0)
    extrinsic = OrderRules(AUTO).of("a", turns, AxesConvention.EXTRINSIC)
    assert extrinsic == found[::-1]


def test_auto_keeps_the_usual_where_nothing_turns() -> None:
    assert OrderRules(AUTO).of("a", NONE) == "ZXY"
