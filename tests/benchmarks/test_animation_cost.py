"""The cost of animations against what a file weighs with and without them, and against figures worked by hand."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from anim.gltf.document import Document, Json
from tests.benchmarks.animation_cost import Cost, animation_cost
from tests.files import glb_of, opened_fixture

PADDING = 12  # bytes at the ends of chunks and views, and digits of lengths that get shorter


@pytest.mark.parametrize("name", ["arm", "biped", "interpolations", "morph_cube"])
def test_it_is_what_the_file_loses_without_them(name: str, tmp_path: Path) -> None:
    whole = opened_fixture(name)
    lost = len(glb_of(whole)) - len(_without_animations(whole))
    cost = animation_cost(_written(tmp_path, whole))
    assert cost.data > 0
    assert cost.total == pytest.approx(lost, abs=PADDING)


def test_a_file_without_animations_costs_nothing(tmp_path: Path) -> None:
    whole = opened_fixture("arm")
    bare = replace(whole, json={key: each for key, each in whole.json.items() if key != "animations"})
    assert animation_cost(_written(tmp_path, bare)) == Cost(0, 0)


def test_a_codec_counts_as_stored_with_its_declaration(tmp_path: Path) -> None:
    """Times plain, values compressed from 64 bytes to 20; the fallback buffer and the name twice belong to it."""
    name = "EXT_meshopt_compression"
    codec = {"buffer": 0, "byteOffset": 8, "byteLength": 20, "byteStride": 16, "count": 4, "mode": "ATTRIBUTES"}
    parts: Json = {
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC4"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 8},
            {"buffer": 1, "byteLength": 64, "extensions": {name: codec}},
        ],
        "animations": [
            {
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
                "samplers": [{"input": 0, "output": 1}],
            }
        ],
    }
    fallback = {"byteLength": 64, "extensions": {name: {"fallback": True}}}
    content: Json = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [name],
        "extensionsRequired": [name],
        "nodes": [{}],
        "buffers": [{"byteLength": 28, "uri": "data:application/octet-stream;base64," + 38 * "A" + "=="}, fallback],
        **parts,
    }
    path = tmp_path / "codec.gltf"
    path.write_text(json.dumps(content))
    lists = _length(parts) - 2 + 1  # no braces, one more comma; the lists that stay empty are not charged
    declared = 2 * (len(name) + 3) + _length(fallback) + 1
    assert animation_cost(path) == Cost(8 + 20, lists - len('"accessors":[],"bufferViews":[],') + declared)


def _without_animations(document: Document) -> bytes:
    """The file without animations: in fixtures, their accessors and views are the last ones, one each."""
    content = {key: each for key, each in document.json.items() if key != "animations"}
    samplers = [each for clip in document.json["animations"] for each in clip["samplers"]]
    first = min(number for each in samplers for number in (each["input"], each["output"]))
    end = content["bufferViews"][content["accessors"][first]["bufferView"]]["byteOffset"]
    content["bufferViews"] = content["bufferViews"][: content["accessors"][first]["bufferView"]]
    content["accessors"] = content["accessors"][:first]
    content["buffers"] = [{"byteLength": end}]
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False).encode()
    head = 12 + 8 + len(text) + 8
    return bytes(head) + document.buffers[0].data[:end].tobytes()


def _length(part: object) -> int:
    return len(json.dumps(part, separators=(",", ":"), ensure_ascii=False))


def _written(folder: Path, document: Document) -> Path:
    path = folder / "file.glb"
    path.write_bytes(glb_of(document))
    return path
