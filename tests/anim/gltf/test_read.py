"""Skeletons, clips and scenes: what the file's numbers mean, against hand-made files and trimesh."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import fixtures
from anim.errors import FormatError, UnsupportedError
from anim.gltf import read
from anim.model import Interpolation, Kind, Scene, Storage
from anim.sampling import rest, world_matrices
from fixtures.broken.pieces import animated, buffered, text
from tests.clips import about
from tests.files import opened, opened_fixture, opened_path

Json = dict[str, Any]

FLOAT, UINT8, UINT16, UINT32, INT8, INT16 = 5126, 5121, 5123, 5125, 5120, 5122
CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


# Skeleton


def test_nodes_keep_their_numbers_names_and_parents() -> None:
    nodes = [{"name": "hip", "children": [2, 1]}, {"name": "knee"}, {}, {"children": [0], "translation": [1, 2, 3]}]
    skeleton = read.skeleton(opened(text({"nodes": nodes})))
    assert skeleton.names == ("hip", "knee", "", "")
    assert skeleton.parents.tolist() == [3, 0, 0, -1]
    assert skeleton.translation.tolist() == [[0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 2, 3]]
    assert skeleton.rotation.tolist() == [[0, 0, 0, 1]] * 4
    assert skeleton.scale.tolist() == [[1, 1, 1]] * 4


def test_rotations_are_made_unit() -> None:
    skeleton = read.skeleton(opened(text({"nodes": [{"rotation": [0, 0, 3, -4]}]})))
    np.testing.assert_allclose(skeleton.rotation, [[0, 0, 0.6, -0.8]], atol=1e-15)


def test_a_matrix_is_taken_apart() -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(about("y", 40)).as_matrix() * [2, 3, 0.5]
    matrix[:3, 3] = 1, 2, 3
    skeleton = read.skeleton(opened(text({"nodes": [{"matrix": matrix.T.ravel().tolist()}]})))
    np.testing.assert_allclose(skeleton.translation, [[1, 2, 3]])
    np.testing.assert_allclose(skeleton.rotation, [about("y", 40)], atol=1e-12)
    np.testing.assert_allclose(skeleton.scale, [[2, 3, 0.5]])
    assert len(skeleton.sheared) == 0


@pytest.mark.parametrize(
    "scale", [[-1, 2, 3], [1, -2, 3], [-1, -2, -3], [0, 2, 3], [0, 0, 3], [0, 0, 0], [1e-8, 1, 1e8]]
)
def test_mirrors_and_flat_matrices_come_back_whole(scale: list[float]) -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat([0.1, 0.5, -0.5, 0.7]).as_matrix() * scale
    skeleton = read.skeleton(opened(text({"nodes": [{"matrix": matrix.T.ravel().tolist()}]})))
    np.testing.assert_allclose(
        world_matrices(skeleton, rest(skeleton))[0, 0], matrix[:3], atol=1e-12 * max(map(abs, scale))
    )


def test_a_sheared_matrix_is_kept_whole() -> None:
    matrix = np.eye(4)
    matrix[0, 1], matrix[2, 3] = 0.5, 7
    skeleton = read.skeleton(opened(text({"nodes": [{}, {"matrix": matrix.T.ravel().tolist()}]})))
    assert skeleton.sheared.tolist() == [1]
    np.testing.assert_array_equal(world_matrices(skeleton, rest(skeleton))[0, 1], matrix[:3])


@pytest.mark.parametrize(
    ("node", "message"),
    [
        ({"translation": [0, 0]}, r"nodes\[0\].translation: has 2 numbers"),
        ({"rotation": [0, 0, 0]}, r"nodes\[0\].rotation: has 3 numbers"),
        ({"rotation": [0, 0, 0, "1"]}, r"nodes\[0\].rotation: holds a string"),
        ({"scale": [1, 1, True]}, r"nodes\[0\].scale: holds a boolean"),
        ({"scale": None}, r"nodes\[0\].scale: is null"),
        ({"matrix": [1] * 15}, r"nodes\[0\].matrix: has 15 numbers"),
        ({"matrix": [1] * 16, "scale": [1, 1, 1]}, "both a matrix and"),
        ({"children": 1}, r"nodes\[0\].children: is 1"),
        ({"children": [1]}, r"nodes\[0\].children\[0\]: is 1"),
        ({"mesh": 0}, r"nodes\[0\].mesh: is 0"),
        ({"skin": 0}, r"nodes\[0\].skin: is 0"),
        ({"name": 7}, r"nodes\[0\].name"),
    ],
)
def test_nodes_that_are_none_are_refused(node: Json, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        opened(text({"nodes": [node]}))


# Clips


def test_tracks_have_their_channels_targets_and_modes() -> None:
    (clip,) = read.clips(opened_fixture("interpolations"))
    assert clip.name == "move"
    names = [read.skeleton(opened_fixture("interpolations")).names[track.node or 0] for track in clip.tracks]
    assert names == [f"{track.interpolation.lower()}_{track.path}" for track in clip.tracks]
    assert len({id(track.times) for track in clip.tracks}) == 1  # one input accessor, one array


def test_cubic_keys_are_in_tangent_value_out_tangent() -> None:
    """Of morph weights: all in-tangents, then all values, then all out-tangents of a key."""
    clip = next(clip for clip in read.clips(opened_fixture("morph_cube")) if clip.name == "cubic")
    (track,) = clip.tracks
    assert track.values.tolist() == [[0, 0.25, 0], [1, 0.5, 0.5], [0, 0.25, 0]]
    assert track.in_tangents is not None
    assert track.out_tangents is not None
    assert track.in_tangents.tolist() == [[0, 0, 0], [0, 1, -1], [0, 1, -1]]
    assert track.out_tangents.tolist() == [[0, 1, -1], [0, 1, -1], [0, 0, 0]]


@pytest.mark.parametrize(
    ("name", "node", "path", "kind", "width"),
    [
        ("color", None, "pointer", Kind.VECTOR, 4),
        ("turn", 0, "rotation", Kind.ROTATION, 4),
        ("blink", None, "pointer", Kind.DISCRETE, 1),
        ("light", None, "pointer", Kind.VECTOR, 1),
        ("weights", 0, "weights", Kind.VECTOR, 2),
        ("one_weight", None, "pointer", Kind.VECTOR, 1),
    ],
)
def test_pointers(name: str, node: int | None, path: str, kind: Kind, width: int) -> None:
    clip = next(clip for clip in read.clips(opened_fixture("pointer")) if clip.name == name)
    (track,) = clip.tracks
    assert (track.node, track.path, track.kind, track.values.shape) == (node, path, kind, (3, width))
    assert (track.pointer or "").startswith("/")
    if name == "blink":
        assert track.interpolation is Interpolation.STEP
        assert track.storage == Storage(UINT8, False, "SCALAR")


@pytest.mark.parametrize(
    "target",
    [
        {"path": "translation"},
        {"path": "mood", "node": 0},
        {"path": "pointer"},
        {"path": "pointer", "extensions": {}},
        {"path": "pointer", "extensions": {"KHR_animation_pointer": []}},
        {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": 3}}},
        {"path": "pointer", "node": 0},
    ],
)
def test_channels_without_a_known_target_are_left_out(target: Json) -> None:
    content = animated()
    content["animations"][0]["channels"].append({"sampler": 0, "target": target})
    (clip,) = read.clips(opened(text(content)))
    assert [track.path for track in clip.tracks] == ["translation"]


@pytest.mark.parametrize(
    ("target", "message"),
    [
        (
            {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/nodes/0/translation"}}},
            "second channel",
        ),
        (
            {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/nodes/1/translation"}}},
            "names node 1",
        ),
        ({"node": 1, "path": "translation"}, "is 1"),
        ({"node": 0, "path": "weights"}, "SCALAR"),
        ({"node": 0, "path": "rotation"}, "VEC4"),
    ],
)
def test_targets_that_can_not_be_are_refused(target: Json, message: str) -> None:
    content = animated()
    content["animations"][0]["channels"].append({"sampler": 0, "target": target})
    with pytest.raises(FormatError, match=message):
        read.clips(opened(text(content)))


@pytest.mark.parametrize(
    ("path", "component", "normalized", "good"),
    [
        ("translation", INT16, True, False),
        ("scale", UINT8, True, False),
        ("rotation", INT16, True, True),
        ("rotation", INT8, True, True),
        ("rotation", UINT16, True, True),
        ("rotation", INT16, False, False),
        ("rotation", UINT32, True, False),
        ("translation", FLOAT, True, True),
    ],
)
def test_values_have_the_types_that_their_path_may_have(
    path: str, component: int, normalized: bool, good: bool
) -> None:
    kind, width = ("VEC4", 4) if path == "rotation" else ("VEC3", 3)
    content = animated() | buffered(("SCALAR", FLOAT, [0, 1]), (kind, FLOAT, np.ones((2, width))))
    content["accessors"][1] |= {"componentType": component, "normalized": normalized}
    content["animations"][0]["channels"][0]["target"]["path"] = path
    document = opened(text(content))
    if good:
        assert read.clips(document)[0].tracks[0].storage == Storage(component, normalized, kind)
    else:
        with pytest.raises(FormatError, match="component type"):
            read.clips(document)


def test_a_node_with_a_matrix_may_have_animated_weights() -> None:
    content = _triangle(node={"matrix": np.eye(4).ravel().tolist()}, targets=1)
    keys = buffered(("SCALAR", FLOAT, [0, 1]), ("SCALAR", FLOAT, [0, 1]))
    content["buffers"] += keys["buffers"]
    content["bufferViews"] += [view | {"buffer": 1} for view in keys["bufferViews"]]
    content["accessors"] += [about | {"bufferView": about["bufferView"] + 1} for about in keys["accessors"]]
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    content["animations"] = [{"samplers": [{"input": 1, "output": 2}], "channels": [channel]}]
    assert read.clips(opened(text(content)))[0].tracks[0].values.tolist() == [[0], [1]]


def test_a_fault_is_named_by_clip_track_and_target() -> None:
    content = animated(times=[0.5, 0.4])
    with pytest.raises(FormatError) as caught:
        read.clips(opened(text(content)))
    assert str(caught.value) == (
        "clip 'walk', track 0 (node 0 'hip', translation): times not increasing at key 1 (0.4 s after 0.5 s)"
    )


# Scenes


def test_morph_weights_of_the_node_come_before_the_meshs() -> None:
    (instance,) = read.scene(opened_fixture("morph_cube")).instances
    assert instance.weights.tolist() == [0, 0.25, 0]
    assert instance.mesh.rest_weights.tolist() == [0, 0.75, 0]
    assert instance.mesh.targets.shape == (3, 36, 3)
    bare = read.scene(opened(text(_triangle(node={}, mesh={"weights": [0.5]}, targets=1)))).instances[0]
    assert bare.weights.tolist() == [0.5]
    none = read.scene(opened(text(_triangle(targets=1)))).instances[0]
    assert none.weights.tolist() == [0]


def test_a_node_with_other_weights_than_targets_is_refused() -> None:
    with pytest.raises(FormatError, match="2 weights for 1"):
        read.scene(opened(text(_triangle(node={"weights": [1, 2]}, targets=1))))


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
    mesh = read.scene(opened(text(content))).instances[0].mesh
    assert mesh.faces.tolist() == faces


def test_primitives_stand_one_after_another() -> None:
    content = buffered(("VEC3", FLOAT, CORNERS), ("VEC3", FLOAT, [[5, 5, 5], *CORNERS]), ("SCALAR", UINT16, [1, 2, 3]))
    primitives = [{"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 1}, "indices": 2}]
    content |= {"nodes": [{"mesh": 0}], "meshes": [{"name": "two", "primitives": primitives}]}
    mesh = read.scene(opened(text(content))).instances[0].mesh
    assert mesh.name == "two"
    assert mesh.positions.tolist() == [*CORNERS, [5, 5, 5], *CORNERS]
    assert mesh.faces.tolist() == [[0, 1, 2], [4, 5, 6]]


def test_influences_are_read_from_all_sets_and_unused_ones_are_joint_0() -> None:
    joints, weights = [[1, 0, 1, 200]] * 3, [[0.25, 0.25, 0.25, 0]] * 3
    content = _skinned(joints, weights, second=([[1, 99, 99, 99]] * 3, [[0.25, 0, 0, 0]] * 3))
    (instance,) = read.scene(opened(text(content))).instances
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
        read.scene(opened(text(_skinned(joints, weights))))


def test_a_skinned_mesh_without_influences_is_refused() -> None:
    content = _skinned([[0, 0, 0, 0]] * 3, [[1, 0, 0, 0]] * 3)
    del content["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]
    with pytest.raises(FormatError, match="no JOINTS_0"):
        read.scene(opened(text(content)))


def test_instances_come_depth_first_in_the_scenes_order() -> None:
    content = _triangle() | {"nodes": [{"mesh": 0}, {"mesh": 0, "children": [0]}, {"mesh": 0}, {"mesh": 0}]}
    content["scenes"] = [{"nodes": [3]}, {"nodes": [2, 1]}]
    assert [i.node for i in read.scene(opened(text(content))).instances] == [3, 2, 1, 0]


def test_a_mesh_hidden_by_draco_is_not_handled_and_a_clip_over_it_is() -> None:
    document = opened(fixtures.BROKEN["draco"].data)
    assert len(read.clips(document)) == 1
    with pytest.raises(UnsupportedError, match=r"mesh 0, primitive 0: .*KHR_draco_mesh_compression"):
        read.scene(document)


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
    content = _triangle(node={"scale": [0.5, 0.5, 0.5], "translation": [1, 0, 0]}, targets=1)
    content["extensionsUsed"] = content["extensionsRequired"] = ["KHR_mesh_quantization"]
    words = buffered(("SCALAR", UINT8, np.frombuffer(padded, np.uint8)))
    content["buffers"].append(words["buffers"][0])
    content["bufferViews"].append(words["bufferViews"][0] | {"buffer": 1, "byteStride": len(padded) // 3})
    about = {"bufferView": len(content["bufferViews"]) - 1, "componentType": component, "count": 3, "type": "VEC3"}
    content["accessors"].append(about | {"normalized": normalized})
    number = len(content["accessors"]) - 1
    content["meshes"][0]["primitives"][0] = {"attributes": {"POSITION": number}, "targets": [{"POSITION": number}]}
    (instance,) = read.scene(opened(text(content))).instances
    np.testing.assert_allclose(instance.mesh.positions, stored / scale, rtol=1e-15)
    np.testing.assert_allclose(instance.mesh.targets[0], stored / scale, rtol=1e-15)


@pytest.mark.parametrize("name", ["Fox.glb", "CesiumMan.glb", "Knight.glb"])
def test_vertices_and_faces_are_those_that_trimesh_finds(name: str, asset: Callable[[str], Path]) -> None:
    """Another loader's meshes: the same points, in mesh space, and as many faces."""
    path = asset(name)
    ours = {instance.mesh.name: instance.mesh for instance in read.scene(opened_path(path)).instances}.values()
    loaded: Any = trimesh.load(path, process=False, skip_materials=True)
    theirs = loaded.geometry.values()
    np.testing.assert_array_equal(_sorted([m.positions for m in ours]), _sorted([m.vertices for m in theirs]))
    assert sum(len(m.faces) for m in ours) == sum(len(m.faces) for m in theirs)


def test_bind_poses_put_the_biped_where_its_mesh_is() -> None:
    """World matrix times inverse bind matrix is the identity in the rest pose that the biped was bound in."""
    scene: Scene = read.scene(opened_fixture("biped"))
    world = world_matrices(scene.skeleton, rest(scene.skeleton))[0]
    skin = scene.instances[0].skin
    assert skin is not None
    for joint, inverse in zip(skin.joints, skin.inverse_bind, strict=True):
        product = np.vstack((world[joint], [0, 0, 0, 1])) @ np.vstack((inverse, [0, 0, 0, 1]))
        np.testing.assert_allclose(product, np.eye(4), atol=1e-6)


def _sorted(parts: Any) -> Any:
    points = np.concatenate(parts).astype(np.float32)
    return points[np.lexsort(points.T)]


def _triangle(*, node: Json | None = None, mesh: Json | None = None, targets: int = 0) -> Json:
    content = buffered(("VEC3", FLOAT, CORNERS))
    primitive: Json = {"attributes": {"POSITION": 0}} | ({"targets": [{"POSITION": 0}] * targets} if targets else {})
    content["nodes"] = [{"mesh": 0, **(node or {})}]
    content["meshes"] = [{"primitives": [primitive], **(mesh or {})}]
    return content


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
