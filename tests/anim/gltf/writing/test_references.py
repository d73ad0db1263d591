"""Who refers to what: every place in glTF and its known extensions that names an accessor or a view."""

from __future__ import annotations

from typing import Any

import pytest

from anim.gltf.writing import references
from anim.gltf.writing.unknown_extensions import possible_indices, unknown_extensions

Json = dict[str, Any]

PRIMITIVE: Json = {"attributes": {}}


@pytest.mark.parametrize(
    ("content", "accessors", "views"),
    [
        ({}, set(), set()),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 3, "_X": 4}}]}]}, {3, 4}, set()),
        ({"meshes": [{"primitives": [PRIMITIVE | {"indices": 5}]}]}, {5}, set()),
        ({"meshes": [{"primitives": [PRIMITIVE | {"targets": [{"POSITION": 6}, {"NORMAL": 7}]}]}]}, {6, 7}, set()),
        ({"skins": [{"joints": [1], "inverseBindMatrices": 8}, {"joints": [2]}]}, {8}, set()),
        ({"animations": [{}, {"channels": [], "samplers": [{"input": 1, "output": 2}]}]}, {1, 2}, set()),
        ({"images": [{"bufferView": 9}, {"uri": "a.png"}]}, set(), {9}),
        (
            {"nodes": [{"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 3, "_ID": 4}}}}]},
            {3, 4},
            set(),
        ),
        ({"nodes": [{"mesh": 5, "skin": 6, "children": [7], "camera": 8, "weights": [1, 0]}]}, set(), set()),
        ({"materials": [{"alphaCutoff": 1, "pbrMetallicRoughness": {"baseColorTexture": {"index": 2}}}]}, set(), set()),
        ({"extras": {"a": [1, {"b": 2}]}, "nodes": [{"extras": 3}]}, set(), set()),
        ({"extensions": {"ACME": {"a": [1, {"b": 2}], "c": True, "d": 3.5, "e": "4", "f": None}}}, {1, 2}, {1, 2}),
        ({"extensions": {"ACME": {"a": 6.0, "b": [7.0, -0.5, 1e300 * 1e300]}}}, {6, 7}, {6, 7}),
        (
            {"extensions": {"ACME": {"a": "/accessors/6", "/bufferViews/12/x": "b.gltf#/accessors/3"}}},
            *[{3, 6, 12}] * 2,
        ),
        ({"extensions": {"ACME": ["/nodes/1", "/accessors", "/accessors/{i}", "/meshes/2"]}}, set(), set()),
        ({"extensions": {"ACME": {"a": 1, "extras": [2]}}}, {1}, {1}),
        ({"extensions": {"ACME": 5}}, {5}, {5}),
        ({"scenes": [{"extensions": {"ACME": [[6]]}}]}, {6}, {6}),
        ({"extensions": {"KHR_lights_punctual": {"lights": [{"range": 5}]}}}, set(), set()),
        ({"extensions": {"VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": 1}}}}}}, set(), set()),
        ({"extensions": {"VRM": {"meta": {"texture": 1}, "secondaryAnimation": {"boneGroups": []}}}}, set(), set()),
        ({"textures": [{"source": 1, "extensions": {"KHR_texture_basisu": {"source": 2}}}]}, set(), set()),
        ({"asset": {"version": "2.0", "extras": 7}}, set(), set()),
        ({"nodes": [{"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {}, "extras": 1}}}]}, set(), set()),
    ],
)
def test_each_place(content: Json, accessors: set[int], views: set[int]) -> None:
    found = references.references_outside(content, {0})
    assert found.accessors == accessors
    assert found.views == views


@pytest.mark.parametrize(
    ("content", "buffers"),
    [
        ({"buffer": 1}, {1}),
        ([{"buffer": 2.0}], {2}),
        ({"source": "/buffers/3"}, {3}),
        ({"x": 4, "buffer": True}, set()),
    ],
)
def test_buffers_that_extensions_name(content: Any, buffers: set[int]) -> None:
    found = references.references_outside({"extensions": {"ACME": content, "KHR_lights_punctual": {"buffer": 9}}}, ())
    assert found.frozen_buffers == buffers


def test_meshes_that_extensions_name() -> None:
    content = {"ACME": ["/meshes/3/weights", "/nodes/4", 5.0], "VRM": {"mesh": 6}, "KHR_xmp_json_ld": {"packet": 7}}
    assert references.possible_meshes({"extensions": content}) == {3, 5, 6}


def test_draco_names_a_view() -> None:
    """Its attribute numbers are Draco's own; taking them for views too does no harm."""
    draco = {"KHR_draco_mesh_compression": {"bufferView": 5, "attributes": {"POSITION": 0}}}
    found = references.references_outside({"meshes": [{"primitives": [PRIMITIVE | {"extensions": draco}]}]}, set())
    assert found.views >= {5}
    assert found.accessors == set()


@pytest.mark.parametrize(
    ("accessor", "views"),
    [
        ({}, []),
        ({"bufferView": 1}, [1]),
        ({"sparse": {"indices": {"bufferView": 2}, "values": {"bufferView": 3}}}, [2, 3]),
        ({"bufferView": 1, "sparse": {"indices": {"bufferView": 2}, "values": {"bufferView": 3}}}, [1, 2, 3]),
    ],
)
def test_views_of(accessor: Json, views: list[int]) -> None:
    assert references.views_of(accessor) == views


def test_ids_inside_draco_data_name_no_views() -> None:
    """Or the keys of old clips stay in the file, in views that have the same number as an attribute."""
    draco = {"KHR_draco_mesh_compression": {"bufferView": 3, "attributes": {"POSITION": 0, "JOINTS_0": 1}}}
    json = {"meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 1}, "extensions": draco}]}]}
    assert references.references_outside(json, ()).views == {3}


@pytest.mark.parametrize(
    ("extension", "places"),
    [
        ({"data": 1}, ["/scenes/0/extensions/ACME"]),  # an accessor
        ({"data": 5}, ["/scenes/0/extensions/ACME"]),  # its view
        ({"buffer": 2, "from": 99}, ["/scenes/0/extensions/ACME"]),
        ({"data": 1.0}, ["/scenes/0/extensions/ACME"]),
        ({"data": "/accessors/2"}, ["/scenes/0/extensions/ACME"]),
        ({"data": 3, "buffer": 0, "extras": 1}, []),
    ],
)
def test_extensions_naming_keys(extension: Json, places: list[str]) -> None:
    json = {
        "scenes": [{"extensions": {"ACME": extension}}],
        "bufferViews": [{"buffer": 0}] * 5 + [{"buffer": 2}],
        "accessors": [{"bufferView": 4}, {"bufferView": 5}, {"bufferView": 5}, {"bufferView": 4}],
        "animations": [{"samplers": [{"input": 1, "output": 2}]}, {"samplers": [{"input": 3, "output": 3}]}],
        "extras": 1,
    }
    assert references.extensions_naming_keys(json, [0]) == places


@pytest.mark.parametrize("key", ["node", "input", "count", "samplers", "x"])
@pytest.mark.parametrize("array", ["nodes", "accessors", "animations"])
def test_extensions_below_any_property_are_found(array: str, key: str) -> None:
    """Also below names that the schema has for numbers, in objects that it does not know."""
    json = {array: [{}, {"foo": {key: {"extensions": {"ACME": {"accessor": 3}}}}}]}
    ((place, _),) = unknown_extensions(json)
    assert place == f"/{array}/1/foo/{key}/extensions/ACME"


def test_extensions_among_many_properties_are_found() -> None:
    """Of thousands of objects with one of its own each, in linear time; and hundreds of levels deep."""
    nodes: list[Any] = [{"foo": {f"k{i}": i}} for i in range(20_000)]
    assert unknown_extensions({"nodes": nodes}) == []
    nodes[7]["foo"] = {"extensions": {"ACME": 1}}
    assert unknown_extensions({"nodes": nodes}) == [("/nodes/7/foo/extensions/ACME", 1)]
    deep: dict[str, Any] = {"extensions": {"ACME": 1}}
    for _ in range(400):
        deep = {"foo": deep}
    ((place, content),) = unknown_extensions({"nodes": [deep]})
    assert (place, content) == (f"/nodes/0{'/foo' * 400}/extensions/ACME", 1)


def test_numbers_deep_inside_an_extension_are_found_in_linear_time() -> None:
    """A generator for each level took the square of the depth."""
    deep: Any = [7]
    for i in range(20_000):
        deep = {"a": deep, "b": i + 0.5} if i % 2 else [deep]
    assert possible_indices(deep) == {7}
