"""Small meshes of a bake as one: the same vertices as of each alone, in fewer layers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.errors import RangeError
from anim.model import Mesh, MeshInstance, Scene, Skin
from anim.skinning import bake as baking
from anim.skinning.bake import prepare_bake
from anim.skinning.small_meshes import MAX_VERTICES
from tests.anim.skinning.scenes import mesh
from tests.clips import about, clip, skeleton, track

RNG = np.random.default_rng(5)
NONE = np.zeros(0)
TIMES = np.array([0.0, 0.5, 1.0])
FACES = np.array([[0, 1, 2], [0, 2, 1]])


def _mesh(count: int, *, skinned: bool = False, normals: bool = False) -> Mesh:
    joints, weights = ([[0, 1]] * count, [[0.25, 0.75]] * count) if skinned else ([[]] * count, [[]] * count)
    found = replace(mesh(RNG.normal(size=(count, 3)), joints, weights), faces=FACES)
    return replace(found, normals=RNG.normal(size=(count, 3))) if normals else found


def _scene() -> Scene:
    """Two skins, meshes of four nodes, of which one mirrors, one with morph targets, and one that is large."""
    skins = [Skin(np.array([1, 2]), RNG.normal(size=(2, 3, 4))) for _ in range(2)]
    found = [MeshInstance(0, _mesh(5, skinned=True), skin, NONE) for skin in skins]
    found += [MeshInstance(node, _mesh(4), None, NONE) for node in (1, 2, 3)]
    morphed = replace(_mesh(3), targets=RNG.normal(size=(1, 3, 3)), rest_weights=np.ones(1))
    found.append(MeshInstance(2, morphed, None, np.ones(1)))
    found += [MeshInstance(1, _mesh(6, normals=True), None, NONE) for _ in range(2)]
    found += [MeshInstance(1, _mesh(MAX_VERTICES + 1), None, NONE), MeshInstance(3, _mesh(3), None, NONE)]
    scales = np.ones((4, 3))
    scales[3, 0] = -1
    return Scene(skeleton([-1, 0, 1, 0], scale=scales), tuple(found))


@pytest.mark.parametrize("method", ["lbs", "dqs"])
@pytest.mark.parametrize("normals", [False, True])
def test_vertices_are_those_of_each_mesh_alone(method: str, normals: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = _scene()
    played = clip(track("rotation", TIMES, about("x", [0, 40, 10]), node=1))
    found = prepare_bake(scene, method=method, normals=normals, rigid=True)
    monkeypatch.setattr(baking, "merge_small_meshes", lambda instances, *_, **__: instances)
    alone = prepare_bake(scene, method=method, normals=normals, rigid=True)
    assert len(alone.bound) == len(scene.instances)
    assert len(found.bound) < len(alone.bound) - 2
    assert [each.at for each in found.bind_each()] == [each.at for each in alone.bound]
    np.testing.assert_array_equal(found.faces, alone.faces)
    np.testing.assert_array_equal(found.rest, alone.rest)
    assert found.parts == alone.parts
    one, other = (each.bake(played, times=TIMES).load_all() for each in (found, alone))
    np.testing.assert_array_equal(one.positions, other.positions)
    if normals:
        assert one.normals is not None
        assert other.normals is not None
        np.testing.assert_array_equal(one.normals, other.normals)


def test_a_joint_that_its_own_skin_lacks_is_refused() -> None:
    """Another mesh's skin has so many joints."""
    scene = _scene()
    wrong = replace(_mesh(3, skinned=True), name="coat", joints=np.array([[0, 2]] * 3))
    first, *others = scene.instances
    with pytest.raises(RangeError, match=r"mesh 'coat'.* uses joint 2 \(the skin has 2\)"):
        prepare_bake(replace(scene, instances=(replace(first, mesh=wrong), *others)), rigid=True)
