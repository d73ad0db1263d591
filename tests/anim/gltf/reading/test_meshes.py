"""Scenes: vertices, faces, influences and morphs, by hand and against another loader."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import fixtures
from anim import memory
from anim.errors import FormatError, UnsupportedError
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.model import Scene
from anim.sampling import rest_world
from fixtures.broken.pieces import buffered, text
from tests.anim.gltf.pieces import CORNERS, triangle
from tests.calls import count_calls
from tests.files import opened, opened_fixture, opened_path

Json = dict[str, Any]

FLOAT, UINT8, UINT16, UINT32, INT8, INT16 = 5126, 5121, 5123, 5125, 5120, 5122


def test_morph_weights_of_the_node_come_before_the_meshs() -> None:
    (instance,) = reader.scene(opened_fixture("morph_cube")).instances
    assert instance.weights.tolist() == [0, 0.25, 0]
    assert instance.mesh.rest_weights.tolist() == [0, 0.75, 0]
    assert instance.mesh.targets.shape == (3, 36, 3)
    bare = reader.scene(opened(text(triangle(node={}, mesh={"weights": [0.5]}, targets=1)))).instances[0]
    assert bare.weights.tolist() == [0.5]
    none = reader.scene(opened(text(triangle(targets=1)))).instances[0]
    assert none.weights.tolist() == [0]


def test_a_node_with_other_weights_than_targets_is_refused() -> None:
    with pytest.raises(FormatError, match="2 weights for 1"):
        reader.scene(opened(text(triangle(node={"weights": [1, 2]}, targets=1))))


@pytest.mark.parametrize(
    ("mode", "faces"),
    [
        (0, []),
        (1, []),
        (4, [[0, 1, 2]]),
        (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0]]),
        (None, [[0, 1, 2]]),
    ],
)
@pytest.mark.parametrize("indexed", [True, False])
def test_strips_and_fans_become_triangles_of_one_side(mode: int | None, faces: list[list[int]], indexed: bool) -> None:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]]
    content = buffered(("VEC3", FLOAT, points), ("SCALAR", UINT8, range(5)))
    primitive: Json = {"attributes": {"POSITION": 0}} | ({"mode": mode} if mode is not None else {})
    primitive |= {"indices": 1} if indexed else {}
    content |= {"nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}]}
    mesh = reader.scene(opened(text(content))).instances[0].mesh
    assert mesh.faces.tolist() == faces


def test_primitives_stand_one_after_another() -> None:
    content = buffered(("VEC3", FLOAT, CORNERS), ("VEC3", FLOAT, [[5, 5, 5], *CORNERS]), ("SCALAR", UINT16, [1, 2, 3]))
    primitives = [{"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 1}, "indices": 2}]
    content |= {"nodes": [{"mesh": 0}], "meshes": [{"name": "two", "primitives": primitives}]}
    mesh = reader.scene(opened(text(content))).instances[0].mesh
    assert mesh.name == "two"
    assert mesh.positions.tolist() == [*CORNERS, [5, 5, 5], *CORNERS]
    assert mesh.faces.tolist() == [[0, 1, 2], [4, 5, 6]]


def test_meshes_and_primitives_of_the_same_accessors_are_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    content = triangle(targets=1)
    primitive = content["meshes"][0]["primitives"][0]
    content["materials"] = [{}, {}]
    parts = [{**primitive, "material": i} for i in range(2)]
    content["meshes"] = [{"name": f"m{i}", "weights": [i], "primitives": [parts[i]]} for i in range(2)]
    content["meshes"].append({"primitives": parts})
    content["nodes"] = [{"mesh": i} for i in range(3)]
    counted = count_calls(monkeypatch, Accessors, "floats")
    one, other, both = (each.mesh for each in reader.scene(opened(text(content))).instances)
    assert len(counted) == 4  # position and target, of the first mesh and of the last one
    assert other.positions is one.positions
    assert other.targets is one.targets
    assert [one.name, other.name, both.name] == ["m0", "m1", ""]
    assert [each.rest_weights.tolist() for each in (one, other, both)] == [[0], [1], [0]]
    assert [each.material for mesh in (one, other, both) for each in mesh.primitives] == [0, 1, 0, 1]
    np.testing.assert_array_equal(both.positions, np.concatenate([one.positions] * 2))
    np.testing.assert_array_equal(both.faces, np.concatenate([one.faces, one.faces + len(one.positions)]))


def test_joined_primitives_are_counted_before_they_are_allocated() -> None:
    content = triangle()
    content["meshes"][0]["primitives"] *= 100
    with memory.memory_limit(5_000), pytest.raises(UnsupportedError, match="mesh 0: decoded data"):
        reader.scene(opened(text(content)))


def test_influences_are_read_from_all_sets_and_unused_ones_are_joint_0() -> None:
    joints, weights = [[1, 0, 1, 200]] * 3, [[0.25, 0.25, 0.25, 0]] * 3  # the other quarter is in the second set
    content = _skinned(joints, weights, second=([[1, 99, 99, 99]] * 3, [[0.25, 0, 0, 0]] * 3))
    (instance,) = reader.scene(opened(text(content))).instances
    assert instance.mesh.joints.tolist() == [[1, 0, 1, 0, 1, 0, 0, 0]] * 3
    assert instance.mesh.weights.tolist() == [[0.25, 0.25, 0.25, 0, 0.25, 0, 0, 0]] * 3
    assert instance.skin is not None
    assert instance.skin.joints.tolist() == [1, 2]
    np.testing.assert_array_equal(instance.skin.inverse_bind, np.tile(np.eye(4)[:3], (2, 1, 1)))


@pytest.mark.parametrize(
    ("joints", "weights", "message"),
    [
        ([[2, 0, 0, 0]] * 3, [[1, 0, 0, 0]] * 3, r"vertex 0 uses joint 2 \(the skin has 2\)"),
        ([[0, 0, 0, 0]] * 3, [[1, 0, 0, -0.5]] * 3, "negative"),
        ([[0, 0, 0, 0]] * 2, [[1, 0, 0, 0]] * 3, "3 vertices"),
        ([[0, 0, 0]] * 3, [[1, 0, 0]] * 3, "4 numbers"),
    ],
)
def test_influences_that_can_not_be_are_refused(joints: Any, weights: Any, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        reader.scene(opened(text(_skinned(joints, weights))))


def test_a_skinned_mesh_without_influences_is_refused() -> None:
    content = _skinned([[0, 0, 0, 0]] * 3, [[1, 0, 0, 0]] * 3)
    del content["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]
    with pytest.raises(FormatError, match="no JOINTS_0"):
        reader.scene(opened(text(content)))


def test_instances_come_depth_first_in_the_scenes_order() -> None:
    content = triangle() | {"nodes": [{"mesh": 0}, {"mesh": 0, "children": [0]}, {"mesh": 0}, {"mesh": 0}]}
    content["scenes"] = [{"nodes": [3]}, {"nodes": [2, 1]}]
    assert [i.node for i in reader.scene(opened(text(content))).instances] == [3, 2, 1, 0]


def test_broken_draco_data_is_refused_and_a_clip_over_it_is_read() -> None:
    document = opened(fixtures.BROKEN["draco"].data)
    assert len(reader.clips(document)) == 1
    with pytest.raises(FormatError, match=r"mesh 0, primitive 0: Draco data can't be decoded"):
        reader.scene(document)


@pytest.mark.parametrize(
    ("component", "normalized", "scale"),
    [
        (INT8, True, 127),
        (INT16, True, 32767),
        (UINT8, True, 255),
        (UINT16, True, 65535),
        (INT16, False, 1),
        (UINT8, False, 1),
    ],
)
def test_quantized_meshes(component: int, normalized: bool, scale: int) -> None:
    """KHR_mesh_quantization: the node's own transform takes the numbers back to metres."""
    dtype = {INT8: "<i1", UINT8: "<u1", INT16: "<i2", UINT16: "<u2"}[component]
    stored = np.array([[0, 0, 0], [100, 0, 0], [0, 50, 25]])
    padded = np.pad(stored.astype(dtype), ((0, 0), (0, 1))).tobytes()  # vertices start on four bytes
    content = triangle(node={"scale": [0.5, 0.5, 0.5], "translation": [1, 0, 0]}, targets=1)
    content["extensionsUsed"] = content["extensionsRequired"] = ["KHR_mesh_quantization"]
    words = buffered(("SCALAR", UINT8, np.frombuffer(padded, np.uint8)))
    content["buffers"].append(words["buffers"][0])
    content["bufferViews"].append(words["bufferViews"][0] | {"buffer": 1, "byteStride": len(padded) // 3})
    about = {"bufferView": len(content["bufferViews"]) - 1, "componentType": component, "count": 3, "type": "VEC3"}
    content["accessors"].append(about | {"normalized": normalized})
    number = len(content["accessors"]) - 1
    content["meshes"][0]["primitives"][0] = {"attributes": {"POSITION": number}, "targets": [{"POSITION": number}]}
    (instance,) = reader.scene(opened(text(content))).instances
    np.testing.assert_allclose(instance.mesh.positions, stored / scale, rtol=1e-15)
    np.testing.assert_allclose(instance.mesh.targets[0], stored / scale, rtol=1e-15)


@pytest.mark.parametrize("name", ["Fox.glb", "CesiumMan.glb", "Knight.glb"])
def test_vertices_and_faces_are_those_that_trimesh_finds(name: str, asset: Callable[[str], Path]) -> None:
    """Another loader's meshes: the same points, in mesh space, and as many faces."""
    path = asset(name)
    ours = {instance.mesh.name: instance.mesh for instance in reader.scene(opened_path(path)).instances}.values()
    loaded: Any = trimesh.load(path, process=False, skip_materials=True)
    theirs = loaded.geometry.values()
    np.testing.assert_array_equal(_sorted([m.positions for m in ours]), _sorted([m.vertices for m in theirs]))
    assert sum(len(m.faces) for m in ours) == sum(len(m.faces) for m in theirs)


def test_bind_poses_put_the_biped_where_its_mesh_is() -> None:
    """World matrix times inverse bind matrix is the identity in the rest pose that the biped was bound in."""
    scene: Scene = reader.scene(opened_fixture("biped"))
    world = rest_world(scene.skeleton)
    skin = scene.instances[0].skin
    assert skin is not None
    for joint, inverse in zip(skin.joints, skin.inverse_bind, strict=True):
        product = np.vstack((world[joint], [0, 0, 0, 1])) @ np.vstack((inverse, [0, 0, 0, 1]))
        np.testing.assert_allclose(product, np.eye(4), atol=1e-6)


def _sorted(parts: Any) -> Any:
    points = np.concatenate(parts).astype(np.float32)
    return points[np.lexsort(points.T)]


def _skinned(joints: Any, weights: Any, *, second: tuple[Any, Any] | None = None) -> Json:
    kind = f"VEC{len(joints[0])}"
    arrays = [("VEC3", FLOAT, CORNERS), (kind, UINT8, joints), (kind, FLOAT, weights)]
    attributes = {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}
    if second is not None:
        arrays += [("VEC4", UINT8, second[0]), ("VEC4", FLOAT, second[1])]
        attributes |= {"JOINTS_1": 3, "WEIGHTS_1": 4}
    content = buffered(*arrays)
    content["nodes"] = [{"mesh": 0, "skin": 0}, {"children": [2]}, {}]
    content["meshes"] = [{"primitives": [{"attributes": attributes}]}]
    content["skins"] = [{"joints": [1, 2]}]
    return content


def test_last_primitives_of_the_same_accessors_are_stored_once_if_wanted() -> None:
    content = triangle(targets=1)
    (first,) = content["meshes"][0]["primitives"]
    second = {**first, "mode": 5}
    content["materials"] = [{}, {}]
    parts = [{**each, "material": i % 2} for i, each in enumerate((first, first, second, first, second))]
    content |= {"meshes": [{"primitives": parts}], "nodes": [{"mesh": 0}]}
    document = opened(text(content))
    whole, once = (reader.scene(document, repeats=each) for each in (True, False))
    mesh = once.instances[0].mesh
    assert len(mesh.positions) == 9
    assert mesh.repeats == (0, 2)
    assert len(mesh.stored_primitives) == 3
    assert mesh.primitives == whole.instances[0].mesh.primitives
    assert mesh.count_uses().tolist() == [2] * 3 + [1] * 3 + [2] * 3
    assert once.vertex_count == whole.vertex_count == 15
    again = once.store_repeats().instances[0].mesh
    assert not again.repeats
    for name in ("positions", "faces", "targets", "joints", "weights"):
        np.testing.assert_array_equal(getattr(again, name), getattr(whole.instances[0].mesh, name))
