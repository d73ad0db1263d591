"""Subtrees of joints against a walk from each joint to its root."""

from __future__ import annotations

import numpy as np
import pytest

from anim.skinning.weighted_joints import find_subtrees, subtree_sums


@pytest.mark.parametrize("seed", range(5))
def test_subtrees_of_random_trees(seed: int) -> None:
    """Joints in any order: a parent may come after those below it."""
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
    first, end = find_subtrees(above)
    found = (first[:, None] < first) & (first < end[:, None])
    np.testing.assert_array_equal(found, expected)
    values = random.random(count)
    np.testing.assert_allclose(subtree_sums(above, values), values + expected @ values)


def test_a_long_chain_of_joints_takes_no_table_of_pairs() -> None:
    """The square of 200 000 joints would be 320 GB."""
    count = 200_000
    first, end = find_subtrees(np.arange(count) - 1)
    assert first.tolist() == list(range(count))
    assert (end == count).all()
