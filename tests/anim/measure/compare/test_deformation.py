"""Meshes of the same vertices: is everything that deforms them the same too?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.measure.compare.deformation import same_influences, same_targets
from anim.measure.error.metric import ErrorMetric
from anim.model import Mesh, MeshInstance, Scene
from tests.files import opened_fixture

SAME_SPACE = np.eye(4)[:3]


@pytest.fixture
def body() -> MeshInstance:
    """The biped's skinned mesh."""
    (found,) = reader.scene(opened_fixture("biped")).instances
    return found


@pytest.fixture
def cube() -> Mesh:
    """A cube with morph targets."""
    return reader.scene(opened_fixture("morph_cube")).instances[0].mesh


def test_weights_stored_as_bytes_are_the_same(body: MeshInstance) -> None:
    assert body.skin is not None
    nodes = body.skin.joints
    stored = np.round(255 * body.mesh.weights)
    stored[:, 0] += 255 - stored.sum(axis=1)
    assert same_influences(body.mesh, nodes, replace(body.mesh, weights=stored / 255), nodes)


def test_influences_may_come_in_another_order_and_by_other_indices(body: MeshInstance) -> None:
    assert body.skin is not None
    nodes = body.skin.joints
    mesh = replace(body.mesh, joints=len(nodes) - 1 - body.mesh.joints[:, ::-1], weights=body.mesh.weights[:, ::-1])
    assert same_influences(body.mesh, nodes, mesh, nodes[::-1])
    assert not same_influences(body.mesh, nodes, mesh, nodes)


def test_one_vertex_on_another_joint_is_a_difference(body: MeshInstance) -> None:
    assert body.skin is not None
    nodes, joints = body.skin.joints, body.mesh.joints.copy()
    vertex = int(body.mesh.weights.max(axis=1).argmax())
    joints[vertex] = (joints[vertex] + 1) % len(nodes)
    assert not same_influences(body.mesh, nodes, replace(body.mesh, joints=joints), nodes)


def test_targets_that_were_quantized_are_the_same(cube: Mesh) -> None:
    """In another mesh space, and rounded to its integers like the vertices."""
    new_from_old = np.column_stack((1000 * np.eye(3), [3, 4, 5]))
    points, targets = np.round(1000 * cube.positions + [3, 4, 5]), np.round(1000 * cube.targets)
    assert same_targets(cube, replace(cube, positions=points, targets=targets), new_from_old)
    assert not same_targets(cube, replace(cube, positions=points), new_from_old)


def test_targets_that_differ_or_are_missing(cube: Mesh) -> None:
    assert not same_targets(cube, replace(cube, targets=0.9 * cube.targets), SAME_SPACE)
    fewer = replace(cube, targets=cube.targets[:-1], rest_weights=cube.rest_weights[:-1])
    assert not same_targets(cube, fewer, SAME_SPACE)


def test_scenes_whose_weights_differ_do_not_agree(body: MeshInstance) -> None:
    scene = reader.scene(opened_fixture("biped"))
    mesh = replace(body.mesh, joints=np.zeros_like(body.mesh.joints))
    pairs = ErrorMetric(scene, Scene(scene.skeleton, (replace(body, mesh=mesh),))).pairs
    assert (pairs.by_vertex, pairs.reweighted) == (False, (body.mesh.name,))
