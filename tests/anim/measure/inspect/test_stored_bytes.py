"""Bytes that only animations take, against files by hand and against what removing the animations leaves."""

from __future__ import annotations

from typing import Any

import pytest

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.measure.inspect.stored_bytes import stored_bytes
from tests.files import opened_fixture

FLOAT = {"componentType": 5126}


def _document(accessors: list[Any], views: list[Any], samplers: list[tuple[int, int]], **more: Any) -> Document:
    content = {"asset": {"version": "2.0"}, "accessors": accessors, "bufferViews": views, **more}
    content["animations"] = [{"channels": [], "samplers": [{"input": a, "output": b} for a, b in samplers]}]
    return Document(content, ())


def test_plain_accessors_by_hand() -> None:
    accessors = [
        {"bufferView": 0, **FLOAT, "count": 3, "type": "SCALAR"},
        {"bufferView": 1, **FLOAT, "count": 3, "type": "VEC3"},
        {"bufferView": 1, "byteOffset": 36, "componentType": 5122, "count": 3, "type": "VEC4"},
    ]
    views = [{"buffer": 0, "byteLength": 12}, {"buffer": 0, "byteLength": 100}]
    assert stored_bytes(_document(accessors, views, [(0, 1), (0, 2)])) == 12 + 36 + 24


def test_what_accessors_share_counts_once() -> None:
    """A time axis that is the start of another, and one output for two tracks."""
    accessors = [
        {"bufferView": 0, **FLOAT, "count": 5, "type": "SCALAR"},
        {"bufferView": 0, **FLOAT, "count": 3, "type": "SCALAR"},
        {"bufferView": 0, "byteOffset": 8, **FLOAT, "count": 2, "type": "SCALAR"},
        {"bufferView": 1, **FLOAT, "count": 5, "type": "VEC3"},
    ]
    views = [{"buffer": 0, "byteLength": 20}, {"buffer": 0, "byteLength": 60}]
    assert stored_bytes(_document(accessors, views, [(0, 3), (1, 3), (2, 3)])) == 20 + 60


def test_what_meshes_use_too_does_not_count() -> None:
    accessors = [
        {"bufferView": 0, **FLOAT, "count": 3, "type": "SCALAR"},
        {"bufferView": 1, **FLOAT, "count": 3, "type": "VEC3"},
    ]
    views = [{"buffer": 0, "byteLength": 12}, {"buffer": 0, "byteLength": 36}]
    meshes = [{"primitives": [{"attributes": {"POSITION": 1}}]}]
    assert stored_bytes(_document(accessors, views, [(0, 1)], meshes=meshes)) == 12


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_compressed_views_count_as_compressed(name: str) -> None:
    packed = {"buffer": 0, "byteLength": 17, "byteStride": 12, "count": 3, "mode": "ATTRIBUTES"}
    accessors = [
        {"bufferView": 0, **FLOAT, "count": 3, "type": "SCALAR"},
        {"bufferView": 1, **FLOAT, "count": 2, "type": "VEC3"},
        {"bufferView": 1, "byteOffset": 24, **FLOAT, "count": 1, "type": "VEC3"},
    ]
    views = [{"buffer": 0, "byteLength": 12}, {"buffer": 1, "byteLength": 36, "extensions": {name: packed}}]
    assert stored_bytes(_document(accessors, views, [(0, 1), (0, 2)])) == 12 + 17


def test_nothing_is_stored_of_zeros() -> None:
    accessors = [{**FLOAT, "count": 3, "type": "SCALAR"}, {**FLOAT, "count": 3, "type": "VEC3"}]
    assert stored_bytes(_document(accessors, [], [(0, 1)])) == 0
    assert stored_bytes(Document({"asset": {"version": "2.0"}}, ())) == 0


@pytest.mark.parametrize("name", ["biped", "interpolations", "pointer"])
def test_a_written_file_holds_as_much_less_without_its_animations(name: str) -> None:
    """Written anew, buffers close up: what goes with all animations is what they took, but for padding."""
    document = opened_fixture(name)
    written = writer.replace_clips(document, dict(enumerate(reader.clips(document))))
    size = sum(len(buffer.data) for buffer in written.buffers)
    meshes = sum(view["byteLength"] for i, view in enumerate(written.json["bufferViews"]) if i in _of_meshes(written))
    assert 0 <= size - meshes - stored_bytes(written) <= 4 * len(written.json["bufferViews"])


def _of_meshes(document: Document) -> set[int]:
    content = document.json
    numbers = {n for mesh in content["meshes"] for part in mesh["primitives"] for n in part["attributes"].values()}
    numbers |= {
        n
        for mesh in content["meshes"]
        for part in mesh["primitives"]
        for t in part.get("targets", ())
        for n in t.values()
    }
    numbers |= {part["indices"] for mesh in content["meshes"] for part in mesh["primitives"] if "indices" in part}
    numbers |= {skin["inverseBindMatrices"] for skin in content.get("skins", ())}
    return {content["accessors"][n]["bufferView"] for n in numbers}
