"""Materials in filmstrips: a textured square, built by hand, has the right colors at the right corners."""

from __future__ import annotations

import base64
import io
import math
import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from PIL import Image

from anim.errors import FormatError
from anim.gltf.document import Document
from anim.gltf.reading.materials import read_materials
from anim.show.filmstrip import clips, texture
from anim.show.filmstrip.clips import FrameSelection
from anim.show.filmstrip.filmstrip import Extent, ViewOptions, filmstrip
from anim.show.filmstrip.texture import TextureSampler, decode_image
from fixtures.broken.pieces import FLOAT32, UINT8, buffered, text
from tests.files import opened

REPEAT, CLAMP, MIRROR, NEAREST = 10497, 33071, 33648, 9728
RED, GREEN, BLUE, YELLOW, WHITE = (255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255), (255, 255, 0, 255), (255,) * 4
FOUR = [[RED, GREEN], [BLUE, YELLOW]]
CORNERS = [[-1, 2, 0], [1, 2, 0], [-1, 0, 0], [1, 0, 0]]  # top left, top right, bottom left, bottom right
UV = [[0, 0], [1, 0], [0, 1], [1, 1]]
FRONT = ViewOptions(height=128, azimuth=0, elevation=0)


def encoded(texels: ArrayLike, form: str = "PNG", mode: str = "RGBA") -> bytes:
    """The bytes of an image file."""
    out = io.BytesIO()
    Image.fromarray(np.asarray(texels, np.uint8)).convert(mode).save(out, form)
    return out.getvalue()


def data_uri(data: bytes, media: str = "image/png") -> str:
    return f"data:{media};base64,{base64.b64encode(data).decode()}"


def square(
    texels: ArrayLike = FOUR,
    *,
    material: dict[str, Any] | None = None,
    info: dict[str, Any] | None = None,
    uv: ArrayLike = UV,
    colors: ArrayLike | None = None,
    files: dict[str, bytes] | None = None,
    **parts: Any,
) -> Document:
    """A square in the plane z = 0 that looks at +Z, with a texture as large as itself."""
    arrays: list[Any] = [("VEC3", FLOAT32, CORNERS), ("VEC2", FLOAT32, uv), ("SCALAR", UINT8, [0, 2, 1, 1, 2, 3])]
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    if colors is not None:
        arrays.append((f"VEC{np.shape(colors)[1]}", FLOAT32, colors))
        attributes["COLOR_0"] = 3
    surface = {"baseColorTexture": {"index": 0, **(info or {})}, **(material or {}).pop("pbr", {})}
    content = buffered(*arrays) | {
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": surface, **(material or {})}],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"magFilter": NEAREST}],
        "images": [{"uri": data_uri(encoded(texels))}],
    }
    return opened(text(content | parts), files)


def picture(document: Document, notes: list[str] | None = None, **options: Any) -> Any:
    """The picture of a file from the front."""
    note = (lambda words: None) if notes is None else notes.append
    rows, extent = clips.build_strips(
        clips.of_document(document, [], (), FrameSelection(count=1), note=note, **options)
    )
    return filmstrip(rows, Extent(extent.points, extent.ground), look=FRONT)


def seen(document: Document, notes: list[str] | None = None, *, reach: float = 0.2, **options: Any) -> list[str]:
    """Names of the colors in the middles of the four quarters of the square: top left, top right, then below.

    reach: how far from the middle they are, in heights of the picture.
    """
    image = picture(document, notes, **options)
    places = [
        (12 + round(128 * y), image.shape[1] // 2 + round(128 * x))
        for y in (0.5 - reach, 0.5 + reach)
        for x in (-reach, reach)
    ]
    return [named(image[place].astype(int)) for place in places]


def named(pixel: Any) -> str:
    r, g, b = pixel
    if max(pixel) < 40:
        return "black"
    is_on = tuple(each > max(pixel) * 0.5 for each in (r, g, b))
    names = {(True, False, False): "red", (False, True, False): "green", (False, False, True): "blue"}
    return {**names, (True, True, False): "yellow", (True, True, True): "gray"}.get(is_on, str(pixel))


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
    ("mode", "expected"),
    [(REPEAT, "aabbaabbaabb"), (CLAMP, "aaaaaabbbbbb"), (MIRROR, "bbaaaabbbbaa"), (None, "aabbaabbaabb")],
)
def test_wrap_modes(mode: int | None, expected: str) -> None:
    texels = np.array([[[0, 0, 0, 255], [255, 255, 255, 255]]], np.uint8)
    u = np.arange(-1, 2, 0.25) + 0.125
    found = TextureSampler(texels, (mode or 0, CLAMP), nearest=True).sample(np.stack((u, u), axis=1))
    assert "".join("ab"[round(each)] for each in found[:, 0]) == expected


def test_texels_are_interpolated_in_linear_light() -> None:
    texels = np.array([[[0, 0, 0, 0], [255, 255, 255, 255]]], np.uint8)
    places = np.array([[0.25, 0.5], [0.5, 0.5], [0.75, 0.5], [0.0, 0.5]])
    found = TextureSampler(texels, (REPEAT, REPEAT)).sample(places)
    assert found[:, 0] == pytest.approx([0, 0.5, 1, 0.5])
    assert found[:, 3] == pytest.approx([0, 0.5, 1, 0.5])


def test_textures_are_in_perspective() -> None:
    """Seen at a slant, the middle of the square is where its diagonals meet, not half way on the screen."""
    from anim.show.filmstrip.surface import Coating, Surface

    sampler = TextureSampler(np.array([[RED, GREEN]], np.uint8), (CLAMP, CLAMP), nearest=True)
    faces = np.array([[0, 1, 2]])
    surface = Surface(faces, np.zeros(1, int), (Coating(sampler),), np.array([[0.0, 0], [1, 0], [1, 0]]), None)
    corners = np.array([[[0, 0, 1.0], [10, 0, 1 / 3], [10, 1, 1 / 3]]])  # three times as far on the right
    x = np.array([7.4, 7.6])  # half of the way in space is at 3/4 on the screen
    tint = surface.tint(corners, np.stack((x, x * 0.01), axis=1), np.zeros(2, int))
    assert tint.argmax(axis=1).tolist() == [0, 1]


@pytest.mark.parametrize(
    ("form", "mode"), [("PNG", "RGB"), ("PNG", "L"), ("PNG", "P"), ("JPEG", "RGB"), ("WEBP", "RGBA")]
)
def test_images_are_decoded(form: str, mode: str) -> None:
    found = decode_image(np.frombuffer(encoded(np.full((9, 7, 4), 200), form, mode), np.uint8))
    assert found.shape == (9, 7, 4)
    assert np.abs(found[..., :3].astype(int) - 200).max() <= 4


def test_gray_levels_of_16_bits_are_scaled() -> None:
    data = io.BytesIO()
    Image.fromarray(np.array([[0, 128, 32768, 65535]], np.uint16)).save(data, "PNG")
    found = decode_image(np.frombuffer(data.getvalue(), np.uint8))
    assert found[0, :, 0].tolist() == [0, 0, 128, 255]
    assert (found[..., :3] == found[..., :1]).all()
    assert (found[..., 3] == 255).all()


@pytest.mark.parametrize("form", ["PNG", "JPEG"])
def test_large_images_are_reduced(form: str) -> None:
    texels = np.zeros((600, 3000, 4), np.uint8) + np.array(YELLOW, np.uint8)
    found = decode_image(np.frombuffer(encoded(texels, form, "RGB"), np.uint8))
    assert max(found.shape[:2]) <= 1024
    assert found.shape[1] / found.shape[0] == pytest.approx(5, rel=0.02)
    assert np.abs(found.astype(int) - YELLOW).max() <= 4


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is no PNG, JPEG or WebP"),
        (b"GIF89a" + bytes(50), "is no PNG, JPEG or WebP"),
        (b"\xabKTX 20\xbb" + bytes(50), "is no PNG, JPEG or WebP"),
        (encoded(np.full((64, 64, 4), 9))[:-40], "can't be decoded"),
        (encoded(np.full((64, 64, 4), 9))[:40], "that can be decoded"),
    ],
)
def test_what_is_no_image_is_refused(data: bytes, words: str) -> None:
    with pytest.raises(FormatError, match=words):
        decode_image(np.frombuffer(data, np.uint8))


def test_damaged_images_are_never_a_crash() -> None:
    random = np.random.default_rng(5)
    for form in ("PNG", "JPEG", "WEBP"):
        whole = np.frombuffer(encoded(random.integers(0, 256, (20, 20, 4)), form, "RGB"), np.uint8)
        for _ in range(60):
            broken = whole.copy()
            broken[random.integers(0, len(whole), 3)] = random.integers(0, 256, 3)
            try:
                decode_image(broken)
            except FormatError:
                continue


def test_images_larger_than_memory_should_hold_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(texture, "MAX_PIXELS", 50)
    with pytest.raises(FormatError, match="has 9 × 9 pixels"):
        decode_image(np.frombuffer(encoded(np.zeros((9, 9, 4))), np.uint8))


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
