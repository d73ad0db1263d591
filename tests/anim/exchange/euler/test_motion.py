"""Units and axes of a motion: what `scaled` and `turned_up` do, against matrices of the local transforms."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.exchange.euler.curve import linear
from anim.exchange.euler.evaluate import evaluate_rotation, evaluate_scale, evaluate_translation
from anim.exchange.euler.motion import EulerMotion, EulerNode, Pivots, scale_motion, z_up_to_y_up
from anim.maths import matrix, quaternion
from anim.maths.euler import AxesConvention

AT = np.array((0.0, 0.3, 1.0))
UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # (x, y, z) → (x, z, −y)


def _pivoted() -> EulerNode:
    """Everything differs on each axis, so that no exchange of axes goes unseen."""
    random = np.random.default_rng(8)
    turns = quaternion.normalize(random.normal(size=(2, 4)))
    offsets = random.normal(size=(4, 3))
    keys = np.array((0.0, 1.0))
    curves = [linear(keys, random.uniform(-2, 2, 2)) for _ in range(3)]
    moves = {axis: linear(keys, random.normal(size=2)) for axis in (1, 2)}
    scales = {axis: linear(keys, random.uniform(0.5, 2, 2)) for axis in (0, 1)}
    return EulerNode(
        "a", -1, random.normal(size=3), "ZXY", AxesConvention.EXTRINSIC, np.zeros(3), (curves[0], curves[1], None),
        moves, random.uniform(0.5, 2, 3), scales, Pivots(*turns, *offsets),
    )  # fmt: skip


def _matrices(motion: EulerMotion) -> Floats:
    node = motion.nodes[0]
    return matrix.from_trs(evaluate_translation(node, AT), evaluate_rotation(node, AT), evaluate_scale(node, AT))


def test_scaled_makes_every_length_longer_and_nothing_else() -> None:
    motion = EulerMotion((_pivoted(),))
    expected = _matrices(motion) * [1, 1, 1, 0.01]
    np.testing.assert_allclose(_matrices(scale_motion(motion, 0.01)), expected, atol=1e-12)


def test_turned_up_is_a_change_of_axes() -> None:
    motion = EulerMotion((_pivoted(),))
    before = _matrices(motion)
    expected = np.concatenate((UP @ before[..., :3] @ UP.T, UP @ before[..., 3:]), axis=-1)
    np.testing.assert_allclose(_matrices(z_up_to_y_up(motion)), expected, atol=1e-12)
