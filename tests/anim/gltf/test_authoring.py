"""Documents made from nothing: what is put in is read back, by ours and by pygltflib, and the validator takes it."""

from __future__ import annotations

import numpy as np
import pytest
from pygltflib import GLTF2

from anim.exchange.split_skins import split_by_root
from anim.exchange.stick_mesh import stick_mesh
from anim.gltf import authoring
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Mesh, Skeleton, Skin, Track
from tests import khronos
from tests.files import glb_of, opened, opened_fixture


def _skeleton(count: int = 4) -> Skeleton:
    """A chain with a second root, turned and scaled, one joint without a name."""
    names = ("root", "", *(f"joint {i}" for i in range(2, count - 1)), "other root")
    parents = np.array([-1, *range(count - 2), -1])
    turned = quaternion.normalize(np.random.default_rng(3).normal(size=(count, 4)))
    turned[0] = (0, 0, 0, 1)
    places = np.arange(3 * count).reshape(-1, 3) / 8
    scale = np.ones((count, 3))
    scale[2] = (2, 1, 0.5)
    return Skeleton(names, parents, places, turned, scale)


def _clip(name: str = "move") -> Clip:
    times = np.array((0.0, 0.5, 2.0))
    turns = quaternion.from_rotation_vector(np.array(((0, 0, 0), (0, 1, 0), (1.0, 0, 0))))
    return Clip(
        name,
        (
            Track(1, "rotation", Interpolation.LINEAR, times, turns),
            Track(0, "translation", Interpolation.STEP, times, np.arange(9.0).reshape(3, 3)),
        ),
    )


def _written(document: Document) -> Document:
    """Through bytes, which the Khronos validator takes without a word of warning."""
    data = glb_of(document)
    if not khronos.missing():
        report = khronos.validate(data)
        assert khronos.errors(report) == []
        assert report["issues"]["numWarnings"] == 0
    return opened(data)


def test_the_skeleton_is_read_back() -> None:
    bones = _skeleton()
    document = _written(authoring.build_document(bones, [_clip()]))
    found = reader.skeleton(document)
    assert found.names == bones.names
    np.testing.assert_array_equal(found.parents, bones.parents)
    for part in ("translation", "rotation", "scale"):
        np.testing.assert_allclose(getattr(found, part), getattr(bones, part), atol=1e-6)
    assert document.json["scenes"] == [{"nodes": [0, 3]}]
    assert "rotation" not in document.json["nodes"][0]
    assert [i for i, node in enumerate(document.json["nodes"]) if "scale" in node] == [2]


def test_the_clip_is_read_back() -> None:
    clip = reader.clips(_written(authoring.build_document(_skeleton(), [_clip()])))[0]
    assert clip.name == "move"
    for one, two in zip(clip.tracks, _clip().tracks, strict=True):
        assert (one.node, one.path, one.interpolation) == (two.node, two.path, two.interpolation)
        np.testing.assert_allclose(one.values, two.values, atol=1e-6)
        np.testing.assert_array_equal(one.times, two.times)


@pytest.mark.parametrize("count", [4, 300])  # of joints, one of them in a tree of its own
def test_a_body_hangs_on_the_skeleton(count: int) -> None:
    """More than 256 joints need two bytes for each."""
    bones = _skeleton(count)
    mesh, skin = split_by_root(bones, *stick_mesh(bones))[0]
    document = _written(authoring.build_document(bones, [], [(mesh, skin)]))
    instance = reader.scene(document).instances[0]
    assert instance.skin is not None
    np.testing.assert_array_equal(instance.skin.joints, skin.joints)
    np.testing.assert_allclose(instance.skin.inverse_bind, skin.inverse_bind, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(instance.mesh.positions, mesh.positions, rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(instance.mesh.joints[:, 0], mesh.joints[:, 0])
    np.testing.assert_array_equal(instance.mesh.faces, mesh.faces)
    gltf = GLTF2.load_from_bytes(glb_of(document))
    assert len(gltf.nodes) == count + 1
    accessor = gltf.accessors[gltf.meshes[0].primitives[0].attributes.JOINTS_0]
    assert accessor.componentType == (5121 if count <= 256 else 5123)


def test_a_large_body_has_wide_indices() -> None:
    count = 65_538
    faces = np.arange(count).reshape(-1, 3)
    points = np.random.default_rng(1).normal(size=(count, 3))
    joints, weights = np.zeros((count, 4), np.int64), np.tile((1.0, 0, 0, 0), (count, 1))
    mesh = Mesh("cloud", points, faces, joints, weights, np.zeros((0, count, 3)), np.zeros(0), None)
    skin = Skin(np.array([0]), np.eye(4)[None, :3])
    document = opened(glb_of(authoring.build_document(_skeleton(), [], [(mesh, skin)])))
    found = reader.scene(document).instances[0].mesh
    np.testing.assert_array_equal(found.faces, faces)
    np.testing.assert_allclose(found.positions, points, atol=1e-6)


def test_clips_come_behind_those_that_are_there() -> None:
    document = opened_fixture("biped")
    longer = _written(authoring.add_clips(document, [_clip("one"), Clip("empty", ()), _clip("")]))
    assert [clip.name for clip in reader.clips(longer)] == ["walk", "wave", "jump", "one", ""]
    assert longer.json["animations"][:3] == document.json["animations"]
    assert "name" not in longer.json["animations"][4]
    for key in ("nodes", "meshes", "skins", "materials", "scenes", "asset"):
        assert longer.json[key] == document.json[key]


def test_nothing_to_add_changes_nothing() -> None:
    document = opened_fixture("biped")
    assert authoring.add_clips(document, [Clip("empty", ())]) is document


def test_a_skeleton_alone_needs_no_buffer() -> None:
    document = _written(authoring.build_document(_skeleton(), []))
    assert "buffers" not in document.json
    assert document.json["asset"]["generator"].startswith("gltf-anim ")
