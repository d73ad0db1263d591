"""Subtrees, and products along the paths of trees: sections of levels agree with one level after the other."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats, Ints
from anim.maths import hierarchy, quaternion


def levels_of(parents: list[int]) -> list[Ints]:
    depths: list[int] = []
    for parent in parents:
        depths.append(depths[parent] + 1 if parent >= 0 else 0)
    return [np.flatnonzero(np.array(depths) == depth) for depth in range(max(depths) + 1)]


def test_a_chain_by_hand() -> None:
    local = np.array([[2.0], [3.0], [5.0]])
    parents = np.array([-1, 0, 1])
    found = hierarchy.accumulate(local, parents, levels_of([-1, 0, 1]), np.multiply)
    assert found.tolist() == [[2], [6], [30]]


@pytest.mark.parametrize("depth", [hierarchy.MIN_DEPTH, 401])
def test_deep_trees_have_the_products_of_each_path(depth: int) -> None:
    """Chains of several lengths that leave one trunk; rotations, which do not commute."""
    parents = list(range(-1, depth - 1))
    for start in (0, 17, 200, depth - 5):
        parents += [start, *range(len(parents), len(parents) + 40)]
    random = np.random.default_rng(0)
    local = quaternion.normalize(random.normal(size=(len(parents), 2, 4)))
    found = hierarchy.accumulate(local, np.array(parents), levels_of(parents), quaternion.multiply)
    expected: list[Floats] = []
    for node, parent in enumerate(parents):
        expected.append(local[node] if parent < 0 else quaternion.multiply(expected[parent], local[node]))
    assert found == pytest.approx(np.array(expected), abs=1e-12)


def test_a_deep_tree_takes_few_steps() -> None:
    calls = 0

    def compose(above: Floats, own: Floats) -> Floats:
        nonlocal calls
        calls += 1
        return above * own

    count = 10_000
    parents = np.arange(-1, count - 1)
    hierarchy.accumulate(np.ones((count, 1)), parents, list(np.arange(count)[:, None]), compose)
    assert calls <= 2 * 100


@pytest.mark.parametrize("seed", range(5))
def test_subtrees_of_random_trees(seed: int) -> None:
    """Nodes in any order: a parent may come after those below it. Against a walk from each node to its root."""
    random = np.random.default_rng(seed)
    count = 30
    parents = np.array([random.integers(-1, i) if i else -1 for i in range(count)])
    new = random.permutation(count)
    above = np.empty(count, np.int64)
    above[new] = np.where(parents >= 0, new[parents], -1)
    expected = np.zeros((count, count), bool)
    for j in range(count):
        at = above[j]
        while at >= 0:
            expected[at, j] = True
            at = above[at]
    first, end = hierarchy.find_subtrees(above)
    found = (first[:, None] < first) & (first < end[:, None])
    np.testing.assert_array_equal(found, expected)
    values = random.random(count)
    np.testing.assert_allclose(hierarchy.subtree_sums(above, values), values + expected @ values)


def test_a_long_chain_takes_no_table_of_pairs() -> None:
    """The square of 200 000 nodes would be 320 GB."""
    count = 200_000
    first, end = hierarchy.find_subtrees(np.arange(count) - 1)
    assert first.tolist() == list(range(count))
    assert (end == count).all()


@pytest.mark.parametrize("depth", [1, 5, 300])
def test_nodes_with_those_below_and_above_them(depth: int) -> None:
    """Against a walk from each node to its root."""
    random = np.random.default_rng(depth)
    order = random.permutation(2 * depth)
    parents = np.full(2 * depth, -1)
    for i in range(1, depth):
        parents[order[i]] = order[i - 1]
        parents[order[depth + i]] = order[random.integers(0, depth + i)]
    chosen = random.random(2 * depth) < 2 / depth
    below, above = chosen.copy(), chosen.copy()
    for node in range(2 * depth):
        parent = int(parents[node])
        while parent >= 0:
            below[node] |= chosen[parent]
            above[parent] |= chosen[node]
            parent = int(parents[parent])
    assert (hierarchy.with_descendants(parents, chosen) == below).all()
    assert (hierarchy.with_ancestors(parents, chosen) == above).all()


def test_depths_and_who_is_below_whom_by_hand() -> None:
    """0 ← 1 ← 2, 0 ← 3, and another root, 4."""
    parents = np.array([-1, 0, 1, 0, -1])
    assert hierarchy.find_depths(parents).tolist() == [0, 1, 2, 1, 0]
    subtrees = hierarchy.find_subtrees(parents)
    pairs = [(i, j) for i in range(5) for j in range(5) if hierarchy.is_below(subtrees, i, j)]
    assert pairs == [(1, 0), (2, 0), (2, 1), (3, 0)]


@pytest.mark.parametrize("seed", range(4))
def test_levels_of_some_nodes_are_those_picked_level_by_level(seed: int) -> None:
    random = np.random.default_rng(seed)
    levels = levels_of([-1, *(int(random.integers(-1, i)) for i in range(1, 60))])
    chosen = random.random(60) < seed / 3
    found = hierarchy.filter_levels(levels, chosen)
    assert [level.tolist() for level in found] == [level[chosen[level]].tolist() for level in levels]
    assert hierarchy.filter_levels([], chosen) == ()
