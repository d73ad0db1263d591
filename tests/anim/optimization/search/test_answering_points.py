"""Points that nodes move, against a mask of all points for each node."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats, Ints
from anim.measure.error.point_matrix import CARRIED, PointMatrix
from anim.optimization.search import answering_points
from anim.optimization.search.answering_points import AnsweringPoints
from tests.calls import count_calls

NODES, POINTS = 12, 60


def random_case(seed: int, width: int) -> tuple[PointMatrix, Ints]:
    random = np.random.default_rng(seed)
    order = random.permutation(NODES)
    parents = np.full(NODES, -1)
    for i in range(1, NODES):
        parents[order[i]] = order[random.integers(i)] if random.random() < 0.9 else -1
    factors = random.normal(size=(POINTS, width, 4))
    weights = random.random((POINTS, width)) ** 4
    factors[..., 3] = weights / weights.sum(axis=1, keepdims=True)
    nodes = np.sort(random.choice(NODES, NODES - 3, replace=False))
    return PointMatrix(nodes, random.integers(len(nodes), size=(POINTS, width)), factors), parents


def points_on(points: PointMatrix, parents: Ints, node: int) -> list[int]:
    below = np.arange(NODES) == node
    for _ in range(NODES):
        below |= (parents >= 0) & below[parents]
    share = (points.factors[..., 3] * below[points.nodes][points.joints]).sum(axis=1)
    return np.flatnonzero(share > CARRIED if (share > CARRIED).any() else share > 0).tolist()


def found_points(answering: AnsweringPoints, count: int, nodes: int) -> list[list[int]]:
    """The points of each node: those at which a value is the largest one there."""
    largest = np.array([answering.largest(row, range(nodes)) for row in np.eye(count)]).reshape(count, nodes)
    return [np.flatnonzero(column).tolist() for column in largest.T]


@pytest.mark.parametrize("width", [1, 2, 4, 8])
@pytest.mark.parametrize("seed", range(6))
def test_points_of_every_node(seed: int, width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    points, parents = random_case(seed, width)
    found = AnsweringPoints(points, parents)
    values: Floats = np.random.default_rng(seed).random(POINTS)
    expected = [points_on(points, parents, node) for node in range(NODES)]
    most = [values[each].max(initial=0) for each in expected]
    for overlap in (answering_points.MIN_OVERLAP, 0, 10**6):
        monkeypatch.setattr(answering_points, "MIN_OVERLAP", overlap)
        assert found_points(found, POINTS, NODES) == expected
        assert found.largest(values, range(NODES)).tolist() == most


@pytest.mark.parametrize("width", [3, 8, 24])
@pytest.mark.parametrize("seed", range(4))
def test_points_of_many_faint_weights(seed: int, width: int) -> None:
    """Joints of a point of which none is noticeable alone, some of them the same; in several trees."""
    points, parents = random_case(seed, width)
    factors = points.factors.copy()
    factors[..., 3] = np.random.default_rng(seed).choice([0, 0.03, 0.06, CARRIED], size=(POINTS, width))
    points = PointMatrix(points.nodes, points.joints, factors)
    expected = [points_on(points, parents, node) for node in range(NODES)]
    assert found_points(AnsweringPoints(points, parents), POINTS, NODES) == expected


def test_maxima_in_a_chain() -> None:
    """Every point answers for all nodes above it."""
    count = 1000
    points = PointMatrix(np.arange(count), np.arange(count)[:, None], np.ones((count, 1, 4)))
    values = np.random.default_rng(0).random(count)
    found = AnsweringPoints(points, np.arange(-1, count - 1)).largest(values, range(count))
    assert found.tolist() == np.maximum.accumulate(values[::-1])[::-1].tolist()


@pytest.mark.parametrize("width", [1, 4])
@pytest.mark.parametrize("seed", range(4))
def test_radii_of_every_node(seed: int, width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The largest distance of a node's points, in whatever blocks they are looked for."""
    points, parents = random_case(seed, width)
    random = np.random.default_rng(seed)
    places, centers = random.normal(size=(POINTS, 3, 5)), random.normal(size=(NODES, 3, 5))
    found, expected = AnsweringPoints(points, parents), []
    for node in range(NODES):
        away = places[points_on(points, parents, node)] - centers[node]
        expected.append(np.sqrt((away * away).sum(axis=1)).max(initial=0))
    np.testing.assert_allclose(found.radii(places, range(NODES), centers), expected, rtol=1e-15)
    monkeypatch.setattr(answering_points, "MIN_OVERLAP", 0)
    monkeypatch.setattr(answering_points, "BLOCK", 7)
    np.testing.assert_allclose(found.radii(places, range(NODES), centers), expected, rtol=1e-15)


def test_radii_in_a_chain_look_into_few_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    count = 2000
    points = PointMatrix(np.arange(count), np.arange(count)[:, None], np.ones((count, 1, 4)))
    places = np.linspace([[0.0]] * 3, [[1.0]] * 3, count)
    looked = count_calls(monkeypatch, answering_points, "_farthest")
    found = AnsweringPoints(points, np.arange(-1, count - 1)).radii(places, range(count), places)
    np.testing.assert_allclose(found, np.linspace(np.sqrt(3), 0, count), atol=1e-12)
    assert len(looked) <= 2 * count


def test_no_points() -> None:
    none = PointMatrix(np.empty(0, np.int64), np.empty((0, 1), np.int64), np.empty((0, 1, 4)))
    assert AnsweringPoints(none, np.array([-1, 0])).largest(np.empty(0), [0, 1]).tolist() == [0, 0]


def test_points_answer_for_what_they_noticeably_hang_on() -> None:
    parents = np.array([-1, 0, 1, 1, 0, 0, 0, 0, 0])
    one = PointMatrix(np.array([2, 7]), np.array([[0, 1], [1, 0]]), np.ones((2, 2, 4)) * [[[0.95], [0.05]]])
    assert found_points(AnsweringPoints(one, parents), 2, 9)[2:4] == [[0], []]
    faint = PointMatrix(one.nodes, one.joints, 0.1 * one.factors)
    assert found_points(AnsweringPoints(faint, parents), 2, 9)[2] == [0, 1]  # where none hangs on it noticeably
