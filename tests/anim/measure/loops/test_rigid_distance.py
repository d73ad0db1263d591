"""Distances of rigid parts: as those of products in blocks, whatever the boxes; none where parts aren't rigid."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Ints
from anim.maths import quaternion
from anim.measure.loops import carried_distance, rigid_distance
from anim.measure.loops.rigid_distance import rigid_distances
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Pose, Scene, Skeleton

COUNT = 300


def _tree(seed: int, *, chain: bool) -> Skeleton:
    random = np.random.default_rng(seed)
    parents = np.array([-1, *(i if chain else random.integers(0, i + 1) for i in range(COUNT - 1))])
    turns = quaternion.from_rotation_vector(random.normal(scale=0.3, size=(COUNT, 3)))
    scales = random.choice([1.0, 1.0, -1.0, 0.9, 1.1], size=(COUNT, 3))
    return Skeleton(("",) * COUNT, parents, random.normal(size=(COUNT, 3)), turns, scales)


def _end(skeleton: Skeleton, seed: int) -> tuple[Pose, Pose]:
    """The rest pose, and one in which each node differs from it."""
    random = np.random.default_rng(seed)
    moved = skeleton.translation + random.normal(scale=0.1, size=(COUNT, 3))
    turned = quaternion.from_rotation_vector(random.normal(scale=0.5, size=(COUNT, 3)))
    rest = Pose(np.zeros(1), skeleton.translation[None], skeleton.rotation[None], skeleton.scale[None])
    return rest, Pose(np.zeros(1), moved[None], turned[None], skeleton.scale[None])


@pytest.mark.parametrize("chain", [False, True])
@pytest.mark.parametrize("block", [2, 16, 1024])
@pytest.mark.parametrize("root", [-1, 0])
def test_distances_are_those_of_products(chain: bool, block: int, root: int, monkeypatch: pytest.MonkeyPatch) -> None:
    skeleton = _tree(1, chain=chain)
    skin, ends, nodes = SkinMotion(Scene(skeleton, ())), _end(skeleton, 2), np.arange(COUNT)
    monkeypatch.setattr(rigid_distance, "BLOCK", block)
    monkeypatch.setattr(rigid_distance, "MAX_BLOCKS", 3)
    found = rigid_distances(skeleton, skin.vertices, ends, nodes, root)
    assert found is not None
    assert found == pytest.approx(_by_products(skin, ends, nodes, root, monkeypatch), rel=1e-4)


def _by_products(
    skin: SkinMotion, ends: tuple[Pose, Pose], nodes: Ints, root: int, monkeypatch: pytest.MonkeyPatch
) -> object:
    monkeypatch.setattr(carried_distance, "MAX_MATRICES", COUNT * COUNT)
    return carried_distance.carried_distances(skin, ends, 0 * nodes, nodes, np.array([root]))


def test_many_nodes_with_a_flat_one_are_measured_by_products(monkeypatch: pytest.MonkeyPatch) -> None:
    skeleton = _tree(3, chain=False)
    skin, (start, end), nodes = SkinMotion(Scene(skeleton, ())), _end(skeleton, 4), np.arange(COUNT)
    scale = end.scale.copy()
    scale[0, 7] = 0.0
    end = Pose(end.times, end.translation, end.rotation, scale)
    assert rigid_distances(skeleton, skin.vertices, (start, end), nodes, -1) is None
    monkeypatch.setattr(carried_distance, "MAX_MATRICES", 20 * COUNT)
    blocks = carried_distance.carried_distances(skin, (start, end), 0 * nodes, nodes, np.array([-1]))
    assert blocks == pytest.approx(_by_products(skin, (start, end), nodes, -1, monkeypatch), rel=1e-4)


def test_without_points_nothing_moves() -> None:
    skeleton = _tree(5, chain=False)
    none = SkinMotion(Scene(skeleton, ())).vertices.take(np.zeros(0, np.int64))
    found = rigid_distances(skeleton, none, _end(skeleton, 6), np.array([0, 3]), -1)
    assert found is not None
    assert found.tolist() == [0, 0]
