"""The rest pose of Euler motion: that of single nodes, for all of one convention at once."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.exchange.euler.curve import constant
from anim.exchange.euler.evaluate import evaluate_rotation, evaluate_translation, skeleton
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, EulerNode, Pivots
from anim.maths import euler
from anim.maths.euler import AxesConvention


def _nodes(count: int) -> list[EulerNode]:
    chance = np.random.default_rng(3)
    orders, frames = ("XYZ", "ZXY", "YZ", ""), tuple(AxesConvention)
    pivots = Pivots(
        rotation_pivot=chance.standard_normal(3), pre_rotation=euler.to_quaternion(np.array([0.3]), order="Y")
    )
    return [
        EulerNode(
            f"n{i}",
            i - 1,
            chance.standard_normal(3),
            orders[i % 4],
            frames[i % 2],
            chance.standard_normal(len(orders[i % 4])),
            (None,) * len(orders[i % 4]),
            pivots=pivots if i == 5 else NO_PIVOTS,
        )
        for i in range(count)
    ]


def test_the_rest_pose_is_that_of_every_node_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    nodes, start = _nodes(40), np.zeros(1)
    rotations = np.array([evaluate_rotation(node, start)[0] for node in nodes])
    translations = np.array([evaluate_translation(node, start)[0] for node in nodes])
    calls = []
    whole = euler.to_quaternion

    def counted(angles: Floats, *, order: str, frame: AxesConvention = AxesConvention.INTRINSIC) -> Floats:
        calls.append(order)
        return whole(angles, order=order, frame=frame)

    monkeypatch.setattr(euler, "to_quaternion", counted)
    found = skeleton(EulerMotion(tuple(nodes)))
    assert np.array_equal(found.rotation, rotations)
    assert np.array_equal(found.translation, translations)
    assert len(calls) == 6  # four orders, each in one frame, and the node with pivots twice


def test_curves_don_t_move_the_rest_pose() -> None:
    node = EulerNode("n", -1, np.zeros(3), "X", AxesConvention.INTRINSIC, np.zeros(1), (constant(1.0),))
    assert skeleton(EulerMotion((node,))).rotation.tolist() == [[0, 0, 0, 1]]
