"""Materials in filmstrips: a textured square, built by hand, has the right colors at the right corners."""

from __future__ import annotations

import base64
import math
import re
from typing import Any

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.gltf.reading.materials import read_materials
from fixtures.broken.pieces import text
from tests.anim.show.filmstrip.textured import (
    FOUR,
    GREEN,
    RED,
    UV,
    WHITE,
    YELLOW,
    data_uri,
    encoded,
    picture,
    seen,
    square,
)
from tests.files import opened


def test_the_origin_of_texture_coordinates_is_the_top_left() -> None:
    assert seen(square()) == ["red", "green", "blue", "yellow"]
    assert seen(square(uv=[[0, 1], [1, 1], [0, 0], [1, 0]])) == ["blue", "yellow", "red", "green"]


def test_colors_are_those_of_the_file() -> None:
    """sRGB texels come back as they are but for the light, which is the same for all of them."""
    image = picture(square([[(200, 100, 50, 255)]]))
    r, g, b = image[76, image.shape[1] // 2] / 255.0
    assert (g / r, b / r) == pytest.approx((0.5, 0.25), abs=0.02)


def test_the_factor_multiplies() -> None:
    assert seen(square(material={"pbr": {"baseColorFactor": [1, 0, 1, 1]}})) == ["red", "black", "blue", "red"]


def test_vertex_colors_multiply() -> None:
    assert seen(square(colors=[[1, 0, 1]] * 4)) == ["red", "black", "blue", "red"]
    assert seen(square([[WHITE]], colors=[[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1], [1, 1, 0, 1]]), reach=0.39) == [
        "red", "green", "blue", "yellow"
    ]  # fmt: skip


def test_vertex_colors_that_are_other_data_are_not_drawn() -> None:
    notes: list[str] = []
    assert seen(square(colors=[[0, 0, 0]] * 3 + [[1, 1, 1]]), notes) == ["red", "green", "blue", "yellow"]
    assert notes == [
        "mesh 0: primitive 0: most vertex colors are black, so they are taken for other data and not drawn"
    ]


HOLE = [[RED, GREEN], [(0, 0, 255, 102), YELLOW]]  # alpha 0.4


@pytest.mark.parametrize(
    ("material", "corner"),
    [
        ({}, "blue"),
        ({"alphaMode": "MASK"}, "gray"),
        ({"alphaMode": "MASK", "alphaCutoff": 0.3}, "blue"),
        ({"alphaMode": "MASK", "alphaCutoff": 0.3, "pbr": {"baseColorFactor": [1, 1, 1, 0.7]}}, "gray"),
        ({"alphaMode": "OPAQUE", "alphaCutoff": 0.5}, "blue"),
    ],
)
def test_a_mask_cuts(material: dict[str, Any], corner: str) -> None:
    assert seen(square(HOLE, material=material)) == ["red", "green", corner, "yellow"]


def test_what_is_behind_a_hole_is_seen() -> None:
    document = square(HOLE, material={"alphaMode": "MASK"})
    nodes = [{"mesh": 0}, {"mesh": 1, "translation": [0, 0, -0.1]}]
    primitive = {"attributes": {"POSITION": 0}, "indices": 2, "material": 1}
    red = {"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0, 0, 1]}}
    json = {
        **document.json,
        "nodes": nodes,
        "meshes": [*document.json["meshes"], {"primitives": [primitive]}],
        "materials": [*document.json["materials"], red],
    }
    assert seen(Document(json, document.buffers)) == ["red", "green", "red", "yellow"]


def test_blending_lets_as_much_through_as_alpha_says() -> None:
    pixels = []
    for alpha in (0, 0.25, 0.5, 0.75, 1):
        image = picture(square([[(0, 0, 0, round(255 * alpha))]], material={"alphaMode": "BLEND"}))
        pixels.append(float((image[70:82, 60:-60] / 255.0).mean() ** 2.2))
    assert pixels[4] < 0.01
    assert (np.array(pixels) / pixels[0])[1:4] == pytest.approx([0.75, 0.5, 0.25], abs=0.08)


def test_without_textures_it_has_one_color() -> None:
    assert len(set(seen(square(), textures=False))) == 1


def test_the_material_names_the_set_of_texture_coordinates() -> None:
    document = square(info={"texCoord": 1})
    (primitive,) = document.json["meshes"][0]["primitives"]
    primitive["attributes"]["TEXCOORD_1"] = 1
    del primitive["attributes"]["TEXCOORD_0"]
    assert seen(document) == ["red", "green", "blue", "yellow"]
    assert len(set(seen(square(info={"texCoord": 1})))) == 1, "it has no such set"


def transform(**about: Any) -> dict[str, Any]:
    return {"extensions": {"KHR_texture_transform": about}}


def test_the_example_of_the_texture_transform() -> None:
    """KHR_texture_transform: the lower left quadrant of the image, rotated clockwise by 90 degrees."""
    info = transform(offset=[0, 1], rotation=math.pi / 2, scale=[0.5, 0.5])
    (material,) = read_materials(square(info=info))
    assert material.texture is not None
    matrix = material.texture.transform
    corners = np.column_stack((UV, np.ones(4))) @ matrix.T
    assert corners == pytest.approx(np.array([[0, 1], [0, 0.5], [0.5, 1], [0.5, 0.5]]))
    texels = np.full((4, 4, 4), 255)
    texels[2:, :2] = FOUR
    assert seen(square(texels, info=info)) == ["blue", "red", "yellow", "green"]


def test_scale_and_offset_and_another_set() -> None:
    assert seen(square(info=transform(offset=[0.5, 0]))) == ["green", "red", "yellow", "blue"]
    assert seen(square(info=transform(scale=[0.5, 0.5]))) == ["red"] * 4
    assert len(set(seen(square(info=transform(texCoord=3))))) == 1


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"images": [{"uri": data_uri(b"hello")}]}, "image 0: is no PNG, JPEG or WebP"),
        ({"images": [{"uri": data_uri(b"x", "image/ktx2")}]}, "image 0: data URI has media type 'image/ktx2'"),
        ({"images": [{"uri": "absent.png"}]}, "image 0: 'absent.png' lies beside the file"),
        ({"images": [{"uri": "../up.png"}]}, "image 0: URI '../up.png' leaves the file's folder"),
        ({"images": [{}]}, "image 0: "),
        ({"textures": [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]}, "texture of material 0: is KTX2"),
        ({"textures": [{}]}, "texture of material 0: has no image"),
        ({"textures": [{"source": 7}]}, r"texture of material 0: uses images\[7\]"),
        ({"textures": []}, r"texture of material 0: uses textures\[0\]"),
        ({"textures": ["x"]}, "texture of material 0: "),
        ({"samplers": []}, r"texture of material 0: uses samplers\[0\]"),
        ({"materials": [3]}, "material 0: is 3"),
        ({"materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1]}}]}, "material 0: pbrMetallicRoughness.base"),
        ({"materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": "x"}}}]}, "material 0: pbr"),
        ({"materials": [{"alphaCutoff": "x"}]}, "material 0: alphaCutoff"),
        ({"materials": [{"extensions": []}]}, "material 0: extensions"),
    ],
)
def test_what_can_t_be_shown_is_said(parts: dict[str, Any], words: str) -> None:
    notes: list[str] = []
    assert len(set(seen(square(**parts), notes))) == 1
    assert len(notes) == 1, notes
    assert re.search(words, notes[0]), notes[0]
    seen(square(**parts), textures=False)


def test_what_doesn_t_fit_the_vertices_is_said() -> None:
    notes: list[str] = []
    document = square()
    document.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 0
    assert len(set(seen(document, notes))) == 1
    assert notes == [
        "mesh 0: primitive 0: TEXCOORD_0 has shape (4, 3) for 4 vertices: drawn without texture and vertex colors"
    ]


@pytest.mark.parametrize("extension", ["EXT_texture_webp", None])
def test_webp_is_known_by_its_extension(extension: str | None) -> None:
    named = {"extensions": {"EXT_texture_webp": {"source": 1}}} if extension else {"source": 1}
    images = [
        {"uri": "absent.png"},
        {"uri": data_uri(encoded(np.repeat(np.repeat(FOUR, 16, 0), 16, 1), "WEBP"), "image/webp")},
    ]
    assert seen(square(images=images, textures=[named])) == ["red", "green", "blue", "yellow"]


def test_what_has_no_texture_left_has_its_factor() -> None:
    unreadable: dict[str, Any] = {"textures": [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]}
    assert seen(square(material={"pbr": {"baseColorFactor": [0, 0, 0.8, 1]}}, **unreadable)) == ["blue"] * 4


def test_an_image_in_a_buffer_and_one_beside_the_file() -> None:
    document = square()
    data = encoded(FOUR)
    uri = f"data:application/octet-stream;base64,{base64.b64encode(data).decode()}"
    json = {
        **document.json,
        "buffers": [*document.json["buffers"], {"byteLength": len(data), "uri": uri}],
        "bufferViews": [*document.json["bufferViews"], {"buffer": 1, "byteLength": len(data)}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}],
    }
    assert seen(opened(text(json))) == ["red", "green", "blue", "yellow"]
    beside = square(images=[{"uri": "a%20b.png"}])
    assert seen(beside, resolve={"a b.png": data}.__getitem__) == ["red", "green", "blue", "yellow"]


def test_primitives_have_materials_of_their_own_and_empty_ones_none() -> None:
    document = square()
    (primitive,) = document.json["meshes"][0]["primitives"]
    document.json["meshes"][0]["primitives"] = [{"attributes": {}, "material": 9}, primitive]
    assert seen(document) == ["red", "green", "blue", "yellow"]


@pytest.mark.parametrize("number", ["x", None, 1.5, -3, 99])
def test_a_material_that_is_none_is_not_drawn(number: Any) -> None:
    document = square()
    document.json["meshes"][0]["primitives"][0]["material"] = number
    for textures in (True, False):
        assert len(set(seen(document, textures=textures))) == 1


def test_a_skeleton_on_a_node_with_points_is_drawn_as_sticks() -> None:
    document = square()
    document.json["meshes"][0]["primitives"][0]["mode"] = 0
    document.json["nodes"] = [{"mesh": 0, "children": [1]}, {"translation": [0, 1, 0]}]
    assert picture(document).std() > 1
