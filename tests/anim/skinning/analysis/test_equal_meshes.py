"""Equal skinned meshes, by what deforms them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Floats
from anim.model import MeshInstance
from anim.sampling.pose import PosedSkeleton
from anim.skinning.analysis.equal_meshes import first_equal_mesh
from tests.anim.skinning.scenes import TRIANGLE, mesh, scene

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


def instances(**more: Floats) -> list[MeshInstance]:
    """Two instances of equal meshes, on nodes 0 and 2. more: of the second mesh."""
    one, other = (
        scene(mesh(POINTS, [[0, 1]] * 3, [[0.5, 0.5]] * 3, faces=TRIANGLE, name=name, **parts), [-1, 0])
        for name, parts in (("a", {}), ("b", more))
    )
    return [*one.instances, replace(other.instances[0], node=0)]


def rest(**parts: Floats) -> PosedSkeleton:
    """The skeleton in its rest pose."""
    return PosedSkeleton.at_rest(scene(mesh(POINTS, [[0]] * 3, [[1]] * 3), [-1, 0], **parts).skeleton)


def test_names_and_nodes_do_not_count() -> None:
    assert first_equal_mesh(instances(), rest()) == [0, 0]


def test_a_node_that_mirrors_its_mesh_counts() -> None:
    scales = np.array([[-1.0, 1, 1], [1, 1, 1]])
    assert first_equal_mesh(instances(), rest(scale=scales)) == [0, 1]


def test_vertices_and_skins_count() -> None:
    one, other = instances()
    moved = replace(other, mesh=replace(other.mesh, positions=POINTS + 1e-9))
    assert other.skin is not None
    turned = replace(other, skin=replace(other.skin, joints=other.skin.joints[::-1].copy()))
    assert first_equal_mesh([one, moved, turned, other], rest()) == [0, 1, 2, 0]


def test_morph_targets_move_by_their_node() -> None:
    one, other = instances()
    both = [replace(each, mesh=replace(each.mesh, targets=np.ones((1, 3, 3)))) for each in (one, other)]
    assert first_equal_mesh(both, rest()) == [0, 1]
