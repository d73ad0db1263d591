"""Joints above joints, against a walk from each joint to its root."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from anim.arrays import Ints
from anim.skinning.binding import ancestor_joints


@pytest.mark.parametrize("seed", range(4))
def test_the_nearest_joint_above_each(seed: int) -> None:
    random = np.random.default_rng(seed)
    parents = np.array([random.integers(-1, node) if node else -1 for node in range(40)])
    nodes = random.permutation(40)[: 1 + 8 * seed]
    nodes = np.concatenate((nodes, nodes[: 3 * seed]))  # some are joints twice: the last counts
    last = {node: i for i, node in enumerate(nodes.tolist())}
    expected = []
    for node in nodes.tolist():
        above = int(parents[node])
        while above >= 0 and above not in last:
            above = int(parents[above])
        expected.append(last.get(above, -1))
    assert ancestor_joints(nodes, parents).tolist() == expected


def test_nodes_between_joints_are_passed_once() -> None:
    """A skin of many joints below a long chain without any: the chain is not climbed from each of them."""

    class Counted:
        count = 0

        def __getitem__(self, node: int) -> int:
            self.count += 1
            return min(node, 1000) - 1

    parents = Counted()
    assert set(ancestor_joints(np.arange(1000, 2000), cast(Ints, parents)).tolist()) == {-1}
    assert parents.count < 3 * 2000


def test_a_node_that_is_many_joints_is_looked_at_once() -> None:
    class Counted:
        count = 0

        def __getitem__(self, node: int) -> int:
            self.count += 1
            return node - 1

    parents = Counted()
    assert ancestor_joints(np.tile([0, 1], 500), cast(Ints, parents)).tolist() == [-1, 998] * 500
    assert parents.count == 2
