"""World matrices of the nodes that something hangs on, against the poses of `anim.sampling`."""

from __future__ import annotations

import numpy as np
import pytest

from anim.optimization.search.world_matrices import level_world_matrices, required_levels
from anim.sampling import sample_pose, world_matrices
from tests.anim.optimization.making import scene, waving
from tests.clips import skeleton


def test_worlds_are_those_of_poses() -> None:
    of, at = scene(), np.linspace(0, 2, 9)
    shown = sample_pose(of.skeleton, waving(), at)
    local = [np.swapaxes(part, 0, 1) for part in (shown.translation, shown.rotation, shown.scale)]
    found = level_world_matrices(of.skeleton, local, of.skeleton.levels())
    assert found == pytest.approx(np.swapaxes(world_matrices(of.skeleton, shown), 0, 1), abs=1e-12)


def test_only_ancestors_are_needed() -> None:
    # 0 ─ 1 ─ 2,  1 ─ 3,  4
    tree = skeleton([-1, 0, 1, 1, -1])
    assert [level.tolist() for level in required_levels(tree, np.array([3]))] == [[0], [1], [3]]
    assert required_levels(tree, np.array([4]))[0].tolist() == [4]
