"""Images of an embedded file: external and data images, missing ones, extensions, broken references."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from anim.files import resolver
from anim.gltf.document import Document, copy_json
from anim.gltf.io.uri import encode_data
from anim.show.page.embedding import embed
from tests.anim.show.page.embedded import MARKUP, Json, content_of, png_of
from tests.files import opened, opened_fixture


def _textured(*images: Json, textures: list[Json] | None = None, **more: Any) -> Document:
    """The biped with a material of a base color and a normal texture, of images 0 and the last."""
    document = opened_fixture("biped")
    found = textures or [{"source": i} for i in range(len(images))]
    surface = {"baseColorFactor": [1, 0, 0, 1], "baseColorTexture": {"index": 0}}
    material = {"pbrMetallicRoughness": surface, "normalTexture": {"index": len(found) - 1}, "extras": {"aTexture": 1}}
    json = {**copy_json(document.json), "images": list(images), "textures": found, **more}
    json["materials"][0] = material
    return replace(document, json=json)


def _image(glb: bytes, index: int) -> tuple[bytes, str]:
    """Bytes and media type of an image."""
    document = opened(glb)
    image = document.json["images"][index]
    assert set(image) <= {"bufferView", "mimeType", "name"}
    view = document.json["bufferViews"][image["bufferView"]]
    start = view.get("byteOffset", 0)
    return document.buffers[view["buffer"]].data[start : start + view["byteLength"]].tobytes(), image["mimeType"]


def test_external_and_data_images_become_views() -> None:
    red, blue = png_of(), png_of((0, 0, 250))
    document = _textured({"uri": "skins/red%20one.png", "name": MARKUP}, {"uri": encode_data(blue, "image/png")})
    found = embed(document, {"skins/red one.png": red}.__getitem__)
    assert not found.notes
    assert _image(found.glb, 0) == (red, "image/png")
    assert _image(found.glb, 1) == (blue, "image/png")
    assert content_of(found.glb)["images"][0]["name"] == MARKUP
    assert content_of(found.glb)["materials"] == document.json["materials"]


@pytest.mark.parametrize(
    ("image", "words"),
    [
        ({"uri": "none.png"}, "'none.png'"),
        ({"uri": "../secret.png"}, "leaves the file's folder"),
        ({"uri": "/etc/passwd"}, "is absolute"),
        ({"uri": "http://example.com/a.png"}, "has a scheme"),
        ({"uri": "data:image/png;base64,=="}, "base64"),
        ({"uri": "text.png"}, "is no PNG, JPEG, WebP or AVIF"),
        ({}, "names no file"),
    ],
)
def test_an_image_that_cannot_be_read_is_noted(image: Json, words: str, tmp_path: Path) -> None:
    (tmp_path / "text.png").write_bytes(b"not a picture")
    (tmp_path.parent / "secret.png").write_bytes(png_of())
    found = embed(_textured(image), resolver.CompanionFiles(tmp_path).open)
    assert len(found.notes) == 1
    assert found.notes[0].startswith("1 image not drawn: image 0 (")
    assert words in found.notes[0]
    content = content_of(found.glb)
    bare = {"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}, "extras": {"aTexture": 1}}
    assert content["materials"][0] == bare
    assert Image.open(io.BytesIO(_image(found.glb, 0)[0])).getpixel((0, 0)) == 255
    assert b"uri" not in found.glb


def test_many_missing_images_are_one_note() -> None:
    found = embed(_textured(*({"uri": f"{i}.png"} for i in range(7)), textures=[{"source": 0}, {"source": 6}]))
    assert len(found.notes) == 1, "images without a texture are not missed"
    assert found.notes[0].startswith("2 images not drawn: image 0 ('0.png' lies beside the file, which has no folder)")


def test_ktx2_is_not_drawn_unless_there_is_another_source() -> None:
    ktx = encode_data(b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80), "image/png")
    basisu = {"extensions": {"KHR_texture_basisu": {"source": 0}}}
    required = {"extensionsUsed": ["KHR_texture_basisu"], "extensionsRequired": ["KHR_texture_basisu"]}
    alone = embed(_textured({"uri": ktx}, textures=[basisu], **required))
    assert alone.notes == ["1 image not drawn: image 0 (is KTX2)"]
    assert "extensionsRequired" not in content_of(alone.glb)
    png = {"uri": encode_data(png_of(), "image/png")}
    both = embed(_textured({"uri": ktx}, png, textures=[{**basisu, "source": 1}]))
    assert not both.notes
    assert content_of(both.glb)["textures"] == [{"source": 1}]


def test_broken_references_to_textures_are_dropped() -> None:
    document = _textured(textures=[{"source": 0}, {"source": True}, {"source": 99}])
    document.json["materials"][0]["emissiveTexture"] = {"index": 17}
    found = embed(document)
    assert found.notes == ["3 textures without an image: drawn without"]
    assert set(content_of(found.glb)["materials"][0]) == {"pbrMetallicRoughness", "extras"}
