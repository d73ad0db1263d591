"""Influences by groups: the same as looking at every joint and every group alone."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats, Ints
from anim.measure.error.influences import GroupedInfluences

JOINTS = 7


def _influences(seed: int) -> tuple[Ints, Floats]:
    """Joints (V, I) and weights of 40 vertices: some without influence, some twice of one joint."""
    random = np.random.default_rng(seed)
    joints = random.integers(0, JOINTS, (40, 3))
    weights = random.uniform(size=(40, 3)) * (random.uniform(size=(40, 3)) < 0.7)
    joints[0], weights[0] = (4, 4, 2), (0.3, 0.5, 0.2)
    weights[1] = 0
    joints[2:9, 0], weights[2:9] = range(JOINTS), (1, 0, 0)  # each has one
    return joints, weights


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("of_each", [False, True], ids=["points", "points of each influence"])
def test_groups_one_by_one(seed: int, of_each: bool) -> None:
    joints, weights = _influences(seed)
    points = np.random.default_rng(seed).normal(size=(40, 3, 3) if of_each else (40, 3))
    found = GroupedInfluences(joints, weights, JOINTS)
    leader = np.where(weights.any(axis=1), joints[np.arange(40), weights.argmax(axis=1)], -1)
    assert found.main_joints == sorted(set(leader.tolist()) - {-1})
    for joint, group, reach, products in zip(
        found.main_joints, found.groups, found.reach, found.products(points), strict=True
    ):
        assert group.tolist() == [v for v in range(40) if leader[v] == joint]
        assert reach.tolist() == sorted({int(joints[v, i]) for v in group for i in range(3) if weights[v, i] > 0})
        expected = np.zeros((len(group), len(reach), 4))
        for row, v in enumerate(group):
            for i in np.flatnonzero(weights[v]):
                place = points[v, i] if of_each else points[v]
                expected[row, reach.tolist().index(joints[v, i])] += weights[v, i] * np.append(place, 1)
        np.testing.assert_array_equal(products, expected.reshape(len(group), -1))


@pytest.mark.parametrize("of_each", [False, True], ids=["points", "points of each influence"])
def test_boxes_one_by_one(of_each: bool) -> None:
    joints, weights = _influences(1)
    points = np.random.default_rng(1).normal(size=(40, 3, 3) if of_each else (40, 3))
    boxes = GroupedInfluences(joints, weights, JOINTS).boxes(points)
    for joint, box in enumerate(boxes):
        v, i = np.nonzero((joints == joint) & (weights > 0))
        own = points[v, i] if of_each else points[v]
        assert sorted(box.tolist()) == sorted(
            [x, y, z] for x in _ends(own[:, 0]) for y in _ends(own[:, 1]) for z in _ends(own[:, 2])
        )


@pytest.mark.parametrize("shape", [(0, 4), (0, 0), (3, 0), (3, 2)])
def test_no_influence(shape: tuple[int, int]) -> None:
    found = GroupedInfluences(np.zeros(shape, np.int64), np.zeros(shape), 0)
    points = np.zeros((shape[0], 3))
    assert (found.main_joints, found.groups, found.reach, found.products(points)) == ([], [], [], [])
    assert found.boxes(points).shape == (0, 8, 3)


def _ends(values: Floats) -> tuple[float, float]:
    return float(values.min()), float(values.max())
