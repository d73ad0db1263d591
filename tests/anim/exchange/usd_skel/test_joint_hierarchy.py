"""Hierarchies of joints, against plain loops over all nodes above each joint."""

from __future__ import annotations

import numpy as np
import pytest

from anim.exchange.usd_skel.joint_hierarchy import NodeOrder, join_joints
from anim.model.skeleton import ancestors
from tests.clips import skeleton


@pytest.mark.parametrize("seed", range(40))
def test_random_trees(seed: int) -> None:
    rng = np.random.default_rng(seed)
    parents = [-1 if i == 0 or rng.random() < 0.03 else int(rng.integers(max(0, i - 4), i)) for i in range(30)]
    joints = rng.choice(30, size=int(rng.integers(1, 6)), replace=False).tolist()
    animated = set(rng.choice(30, size=3).tolist())
    found = join_joints(joints, NodeOrder(skeleton(parents)), animated)
    chains = [list(ancestors(parents, joint)) for joint in joints]
    above = next((node for node in chains[0] if all(node in chain for chain in chains)), -1)
    moving = [node for node in (above, *ancestors(parents, above)) if node in animated]
    assert found.anchor == (parents[moving[-1]] if moving else above)
    between = {node for chain in chains for node in chain if found.anchor in [*ancestors(parents, node), -1]}
    assert set(found.joints) == between.union(joints)
    assert found.parents.tolist() == [
        found.joints.index(parents[node]) if parents[node] in found.joints else -1 for node in found.joints
    ]
    assert all(parent < i for i, parent in enumerate(found.parents.tolist()))


def test_branches_stay_together() -> None:
    order = NodeOrder(skeleton([-1, 0, 1, 1, 2, 3]))
    anchor, joints, above = join_joints([1, 4, 5], order, ())
    assert (anchor, joints, above.tolist()) == (0, (1, 2, 4, 3, 5), [-1, 0, 1, 0, 3])
