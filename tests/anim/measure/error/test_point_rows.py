"""Displacements of points block by block, against the whole product."""

from __future__ import annotations

import numpy as np
import pytest

from anim.measure.error import point_matrix as points_
from anim.measure.error import point_rows
from anim.measure.error.point_matrix import PointMatrix
from anim.measure.error.point_rows import BLOCK_ROWS, MAX_USED_FRACTION, OneJointRows, stack_points

NODES, FRAMES = 40, 5


def _points(count: int, width: int, seed: int = 0) -> PointMatrix:
    """Points on up to `width` joints each, of which the first ones have the largest weights."""
    random = np.random.default_rng(seed)
    weights = np.sort(random.random((count, width)) ** 3)[:, ::-1]
    weights[:, 1:] *= random.random((count, width - 1)) < 0.8  # fewer joints, as where influences are padded
    weights /= weights.sum(axis=1, keepdims=True)
    near = random.integers(NODES, size=(count, 1)) + random.integers(0, 3, size=(count, width))
    factors = np.concatenate((random.normal(size=(count, width, 3)), np.ones((count, width, 1))), axis=2)
    return PointMatrix(np.arange(NODES), near % NODES, factors * weights[..., None])


def _change(seed: int = 1) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Differences of stacked matrices (4 J, 3 F)."""
    return stack_points(np.random.default_rng(seed).normal(size=(NODES, FRAMES, 3, 4)), np.arange(NODES))


@pytest.mark.parametrize("dense", [0, points_.DENSE])
@pytest.mark.parametrize("width", [1, 4])
@pytest.mark.parametrize("count", [1, BLOCK_ROWS, 5 * BLOCK_ROWS + 7])
@pytest.mark.parametrize("sorted_", [False, True])
def test_blocks_are_the_rows_of_all_moves(
    sorted_: bool, count: int, width: int, dense: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of points in the order of joints or in none, in a dense matrix, a sparse one, and one of a joint per row."""
    monkeypatch.setattr(points_, "DENSE", dense)
    points = _points(count, width)
    points = points.by_joint() if sorted_ else points
    kind = np.ndarray if dense else OneJointRows if width == 1 else None
    assert kind is None or isinstance(points._matrix, kind)
    moves = points.rows().moves(_change())
    found = np.full((count, 3, FRAMES), np.nan, np.float32)
    for rows, some in points.rows().blocks(_change()):
        assert np.isnan(found[rows]).all()
        found[rows] = some
    assert found == pytest.approx(moves, rel=1e-5, abs=1e-5)
    plain = np.array([
        sum(
            (_change().reshape(NODES, 4, 3, FRAMES)[joint] * factor[:, None, None]).sum(axis=0)
            for joint, factor in zip(joints, factors, strict=True)
        )
        for joints, factors in zip(points.joints, points.factors, strict=True)
    ])  # fmt: skip
    assert found == pytest.approx(plain, rel=1e-4, abs=1e-4)


def test_points_by_joint_need_few_columns_in_a_block() -> None:
    used = []
    for points in (_points(1000, 2), _points(1000, 2).by_joint()):
        blocks = list(point_rows._dense_blocks(points.rows()._matrix))
        used.append([NODES * 4 if columns is None else len(columns) for _, columns, _ in blocks])
    assert used[0] == [NODES * 4] * -(-1000 // BLOCK_ROWS)
    assert max(used[1]) < MAX_USED_FRACTION / 2 * 4 * NODES


def test_blocks_do_not_change_the_columns() -> None:
    points, change = _points(200, 4), _change()
    before = change.copy()
    for _, moved in points.rows().blocks(change):
        moved *= 0  # callers compute in place
    np.testing.assert_array_equal(change, before)
    assert np.abs(points.rows().moves(change)).max() > 0.1


@pytest.mark.parametrize("width", [1, 4])
def test_the_order_of_joints_keeps_the_set_of_points(width: int) -> None:
    points = _points(300, width)
    found = points.by_joint()
    assert found.nodes.tolist() == points.nodes.tolist()
    rows = [np.column_stack((each.joints, each.factors.reshape(len(each), -1))).tolist() for each in (points, found)]
    assert rows[0] != rows[1]
    assert sorted(rows[0]) == sorted(rows[1])
    most = found.joints[np.arange(300), found.factors[..., 3].argmax(axis=1)]
    assert (np.diff(most) >= 0).all()


def test_no_points_in_the_order_of_joints() -> None:
    none = PointMatrix(np.empty(0, np.int64), np.empty((0, 1), np.int64), np.empty((0, 1, 4)))
    assert len(none.by_joint()) == 0
    assert sum(len(some) for _, some in none.rows().blocks(np.zeros((0, 6)))) == 0
