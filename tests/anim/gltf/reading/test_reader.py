"""Skeletons and clips: what the file's numbers mean, by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.errors import FormatError
from anim.gltf.reading import reader
from anim.model import AccessorFormat, Interpolation, ValueKind
from anim.sampling import rest_world
from fixtures.broken.pieces import animated, buffered, text
from tests import many
from tests.anim.gltf.pieces import triangle
from tests.clips import about
from tests.files import opened, opened_fixture

Json = dict[str, Any]

FLOAT, UINT8, UINT16, UINT32, INT8, INT16 = 5126, 5121, 5123, 5125, 5120, 5122
CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


# Skeleton


def test_nodes_keep_their_numbers_names_and_parents() -> None:
    nodes = [{"name": "hip", "children": [2, 1]}, {"name": "knee"}, {}, {"children": [0], "translation": [1, 2, 3]}]
    skeleton = reader.skeleton(opened(text({"nodes": nodes})))
    assert skeleton.names == ("hip", "knee", "", "")
    assert skeleton.parents.tolist() == [3, 0, 0, -1]
    assert skeleton.translation.tolist() == [[0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 2, 3]]
    assert skeleton.rotation.tolist() == [[0, 0, 0, 1]] * 4
    assert skeleton.scale.tolist() == [[1, 1, 1]] * 4


def test_rotations_are_made_unit() -> None:
    skeleton = reader.skeleton(opened(text({"nodes": [{"rotation": [0, 0, 3, -4]}]})))
    np.testing.assert_allclose(skeleton.rotation, [[0, 0, 0.6, -0.8]], atol=1e-15)


def test_a_matrix_is_taken_apart() -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(about("y", 40)).as_matrix() * [2, 3, 0.5]
    matrix[:3, 3] = 1, 2, 3
    skeleton = reader.skeleton(opened(text({"nodes": [{"matrix": matrix.T.ravel().tolist()}]})))
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
    skeleton = reader.skeleton(opened(text({"nodes": [{"matrix": matrix.T.ravel().tolist()}]})))
    np.testing.assert_allclose(rest_world(skeleton)[0], matrix[:3], atol=1e-12 * max(map(abs, scale)))


def test_a_sheared_matrix_is_kept_whole() -> None:
    matrix = np.eye(4)
    matrix[0, 1], matrix[2, 3] = 0.5, 7
    skeleton = reader.skeleton(opened(text({"nodes": [{}, {"matrix": matrix.T.ravel().tolist()}]})))
    assert skeleton.sheared.tolist() == [1]
    np.testing.assert_array_equal(rest_world(skeleton)[1], matrix[:3])


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
    (clip,) = reader.clips(opened_fixture("interpolations"))
    assert clip.name == "move"
    names = [reader.skeleton(opened_fixture("interpolations")).names[track.node or 0] for track in clip.tracks]
    assert names == [f"{track.interpolation.lower()}_{track.path}" for track in clip.tracks]
    assert len(clip.time_axes) == 1  # one input accessor


def test_cubic_keys_are_in_tangent_value_out_tangent() -> None:
    """Of morph weights: all in-tangents, then all values, then all out-tangents of a key."""
    clip = next(clip for clip in reader.clips(opened_fixture("morph_cube")) if clip.name == "cubic")
    (track,) = clip.tracks
    assert track.values.tolist() == [[0, 0.25, 0], [1, 0.5, 0.5], [0, 0.25, 0]]
    assert track.in_tangents is not None
    assert track.out_tangents is not None
    assert track.in_tangents.tolist() == [[0, 0, 0], [0, 1, -1], [0, 1, -1]]
    assert track.out_tangents.tolist() == [[0, 1, -1], [0, 1, -1], [0, 0, 0]]


@pytest.mark.parametrize(
    ("name", "node", "path", "kind", "width"),
    [
        ("color", None, "pointer", ValueKind.VECTOR, 4),
        ("turn", 0, "rotation", ValueKind.ROTATION, 4),
        ("blink", None, "pointer", ValueKind.DISCRETE, 1),
        ("light", None, "pointer", ValueKind.VECTOR, 1),
        ("weights", 0, "weights", ValueKind.VECTOR, 2),
        ("one_weight", None, "pointer", ValueKind.VECTOR, 1),
    ],
)
def test_pointers(name: str, node: int | None, path: str, kind: ValueKind, width: int) -> None:
    clip = next(clip for clip in reader.clips(opened_fixture("pointer")) if clip.name == name)
    (track,) = clip.tracks
    assert (track.node, track.path, track.kind, track.values.shape) == (node, path, kind, (3, width))
    assert (track.pointer or "").startswith("/")
    if name == "blink":
        assert track.interpolation is Interpolation.STEP
        assert track.storage == AccessorFormat(UINT8, False, "SCALAR")


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
    (clip,) = reader.clips(opened(text(content)))
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
        reader.clips(opened(text(content)))


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
        assert reader.clips(document)[0].tracks[0].storage == AccessorFormat(component, normalized, kind)
    else:
        with pytest.raises(FormatError, match="component type"):
            reader.clips(document)


def test_a_node_with_a_matrix_may_have_animated_weights() -> None:
    content = triangle(node={"matrix": np.eye(4).ravel().tolist()}, targets=1)
    keys = buffered(("SCALAR", FLOAT, [0, 1]), ("SCALAR", FLOAT, [0, 1]))
    content["buffers"] += keys["buffers"]
    content["bufferViews"] += [view | {"buffer": 1} for view in keys["bufferViews"]]
    content["accessors"] += [about | {"bufferView": about["bufferView"] + 1} for about in keys["accessors"]]
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    content["animations"] = [{"samplers": [{"input": 1, "output": 2}], "channels": [channel]}]
    assert reader.clips(opened(text(content)))[0].tracks[0].values.tolist() == [[0], [1]]


def test_a_fault_is_named_by_clip_track_and_target() -> None:
    content = animated(times=[0.5, 0.4])
    with pytest.raises(FormatError) as caught:
        reader.clips(opened(text(content)))
    assert str(caught.value) == (
        "clip 'walk', track 0 (node 0 'hip', translation): times not increasing at key 1 (0.4 s after 0.5 s)"
    )


def test_equal_channels_of_many_clips_share_one_track() -> None:
    first, *others = (clip.tracks for clip in reader.clips(opened(many.clips_equal(3))))
    assert all(tracks[0] is first[0] for tracks in others)
    assert len({track.digest for clip in reader.clips(opened(many.channels(20))) for track in clip.tracks}) == 10
