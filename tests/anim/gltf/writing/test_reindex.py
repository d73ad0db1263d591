"""Placeholders taken out: whoever names an accessor or a view names the same one afterwards, or nothing changes."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.writing import writer
from anim.gltf.writing.reindex import drop_placeholders
from anim.model import Clip
from fixtures.broken.pieces import animated, glb, text
from tests.anim.gltf.writing.documents import check_same
from tests.anim.gltf.writing.test_compaction import files
from tests.clips import track
from tests.files import REAL, glb_of, opened, opened_path
from tests.khronos import errors, needs_validator, validate_many

Json = dict[str, Any]
Find = Callable[[str], Path]

FLOAT = 5126
HOLE: Json = {"componentType": 5121, "count": 1, "type": "SCALAR"}
EMPTY: Json = {"buffer": 0, "byteLength": 1}


def _file(**more: Any) -> Document:
    """Two placeholders of accessors (0, 2) and of views (0, 1) before what a clip and others use."""
    numbers = struct.pack("<8f", 0, 1, *range(6))
    scalars = {"bufferView": 2, "componentType": FLOAT, "count": 2, "type": "SCALAR"}
    vectors = {"bufferView": 2, "byteOffset": 8, "componentType": FLOAT, "count": 2, "type": "VEC3"}
    content = animated() | {
        "buffers": [{"byteLength": 32}],
        "bufferViews": [EMPTY, EMPTY, {"buffer": 0, "byteLength": 32}],
        "accessors": [HOLE, scalars, HOLE, vectors],
    }
    content["animations"][0]["samplers"] = [{"input": 1, "output": 3}]
    return opened(glb(text(content | more), numbers))


def test_numbers_close_up() -> None:
    document = _file()
    before = json.dumps(document.json)
    after = drop_placeholders(document)
    assert [each.get("bufferView") for each in after.json["accessors"]] == [0, 0]
    assert after.json["bufferViews"] == [{"buffer": 0, "byteLength": 32}]
    assert after.json["animations"][0]["samplers"] == [{"input": 0, "output": 1}]
    assert list(after.json) == list(document.json)
    assert json.dumps(document.json) == before
    check_same(reader.clips(document)[0].tracks[0], reader.clips(opened(glb_of(after)))[0].tracks[0])


def test_a_second_time_there_is_nothing_to_do() -> None:
    after = drop_placeholders(_file())
    assert drop_placeholders(after) is after


@pytest.mark.parametrize(
    ("more", "place"),
    [
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 3}}]}]}, "meshes 0 primitives 0 attributes POSITION"),
        ({"meshes": [{"primitives": [{"attributes": {}, "indices": 3}]}]}, "meshes 0 primitives 0 indices"),
        (
            {"meshes": [{"primitives": [{"attributes": {}, "targets": [{"POSITION": 3}]}]}]},
            "meshes 0 primitives 0 targets 0 POSITION",
        ),
        (
            {"nodes": [{"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": 3}}}}]},
            "nodes 0 extensions EXT_mesh_gpu_instancing attributes SCALE",
        ),
        (
            {"nodes": [{"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": 3.0}}}}]},
            "nodes 0 extensions EXT_mesh_gpu_instancing attributes SCALE",
        ),
    ],
)
def test_who_names_an_accessor_follows(more: Json, place: str) -> None:
    after = drop_placeholders(_file(**more)).json
    assert _at(after, place) == 1


@pytest.mark.parametrize(
    ("more", "place"),
    [
        ({"images": [{"bufferView": 2, "mimeType": "image/png"}]}, "images 0 bufferView"),
        (
            {
                "meshes": [
                    {
                        "primitives": [
                            {
                                "attributes": {},
                                "extensions": {
                                    "KHR_draco_mesh_compression": {"bufferView": 2, "attributes": {"POSITION": 2}}
                                },
                            }
                        ]
                    }
                ]
            },
            "meshes 0 primitives 0 extensions KHR_draco_mesh_compression bufferView",
        ),
    ],
)
def test_who_names_a_view_follows(more: Json, place: str) -> None:
    after = drop_placeholders(_file(**more)).json
    assert _at(after, place) == 0
    if "draco" in place:  # its attributes have numbers of its own
        assert _at(after, place.replace("bufferView", "attributes POSITION")) == 2


def test_matrices_of_a_skin_and_sparse_numbers_follow() -> None:
    matrix = {"bufferView": 1, "componentType": FLOAT, "count": 1, "type": "MAT4"}
    sparse = {
        "count": 1,
        "indices": {"bufferView": 3, "componentType": 5121},
        "values": {"bufferView": 1, "byteOffset": 4},
    }
    content = {
        "nodes": [{}],
        "buffers": [{"byteLength": 68}],
        "bufferViews": [
            EMPTY,
            {"buffer": 0, "byteLength": 64},
            EMPTY,
            {"buffer": 0, "byteOffset": 64, "byteLength": 4},
        ],
        "accessors": [HOLE, matrix, HOLE, {"componentType": FLOAT, "count": 2, "type": "SCALAR", "sparse": sparse}],
        "skins": [{"joints": [0], "inverseBindMatrices": 1}],
        "meshes": [{"primitives": [{"attributes": {"_A": 3}}]}],
    }
    document = opened(glb(text(content), struct.pack("<16f4B", *range(16), 1, 0, 0, 0)))
    after = opened(glb_of(drop_placeholders(document)))
    assert (len(after.json["accessors"]), len(after.json["bufferViews"])) == (2, 2)
    np.testing.assert_array_equal(Accessors(after).raw(after.json["skins"][0]["inverseBindMatrices"]), [range(16)])
    found = Accessors(after).raw(after.json["meshes"][0]["primitives"][0]["attributes"]["_A"])
    assert found.tolist() == [[0], [1]]


@pytest.mark.parametrize(
    "more",
    [
        {"extensions": {"ACME_paths": {"data": [1]}}},
        {"nodes": [{"extensions": {"ACME_paths": 2}}]},
        {"nodes": [{"extensions": {"ACME_paths": 2.0}}]},
        {"extensions": {"KHR_interactivity": {"pointer": "/accessors/2"}}},
        {"extensions": {"KHR_interactivity": {"/bufferViews/2": {}}}},
    ],
)
def test_where_an_unknown_number_might_mean_one_nothing_changes(more: Json) -> None:
    document = _file(**more)
    assert drop_placeholders(document).json["accessors"] is document.json["accessors"]


def test_unknown_numbers_beyond_the_lists_or_before_the_holes_pin_nothing() -> None:
    document = _file(extensions={"ACME": {"version": 4, "year": 2026, "share": 0.5, "flag": True}}, extras={"id": 1})
    assert len(drop_placeholders(document).json["accessors"]) == 2
    content = dict(document.json)
    content["bufferViews"] = content["bufferViews"][2:]
    content["accessors"] = [{**each, "bufferView": 0} for each in content["accessors"][1::2]] + [HOLE, HOLE]
    content["accessors"].append({"bufferView": 0, "componentType": FLOAT, "count": 1, "type": "SCALAR"})
    content["animations"][0]["samplers"] = [{"input": 0, "output": 1}]
    content["meshes"] = [{"primitives": [{"attributes": {"_A": 4}}]}]
    content["extensions"] = {"ACME": {"which": 1}}
    after = drop_placeholders(Document(content, document.buffers))
    assert len(after.json["accessors"]) == 3
    assert after.json["meshes"][0]["primitives"][0]["attributes"] == {"_A": 2}
    assert after.json["extensions"] == {"ACME": {"which": 1}}


@pytest.mark.parametrize(
    "more",
    [
        {"nodes": [{"extensions": {"EXT_mesh_gpu_instancing": 5}}]},
        {"nodes": [{"extensions": {"EXT_mesh_gpu_instancing": {"attributes": [1]}}}]},
        {"nodes": [{"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"A": 99, "B": -1, "C": "x"}}}}]},
    ],
)
def test_broken_extensions_stay_as_they_are(more: Json) -> None:
    """Reading does not check them, so what names nothing must do no harm here."""
    assert drop_placeholders(_file(**more)).json["nodes"] == more["nodes"]


@settings(max_examples=100)
@given(content=files(), blob=st.binary(min_size=96, max_size=96))
def test_random_files_keep_what_meshes_and_clips_use(content: Json, blob: bytes) -> None:
    document = opened(glb(text(content), blob + struct.pack("<8f", 0, 1, *range(6))))
    clip = Clip("", (track("translation", [0.0, 1.0], [[1, 2, 3], [4, 5, 6]]),))
    written = writer.replace_clips(document, {0: clip})
    after = opened(glb_of(drop_placeholders(written)))
    old, new = (each.json["meshes"][0]["primitives"][0]["attributes"] for each in (written, after))
    for name in old:
        np.testing.assert_array_equal(Accessors(written).raw(old[name]), Accessors(after).raw(new[name]))
    check_same(clip.tracks[0], reader.clips(after)[0].tracks[0])
    if "extensions" not in content:
        assert HOLE not in after.json["accessors"]
        assert glb_of(drop_placeholders(after)) == glb_of(after)


@pytest.mark.slow
@needs_validator
def test_real_files_stay_valid_and_get_smaller(asset: Find) -> None:
    documents, results = [], []
    for name in REAL:
        document = opened_path(asset(name))
        clips = {i: Clip(clip.name, clip.tracks[:2]) for i, clip in enumerate(reader.clips(document))}
        documents.append(writer.replace_clips(document, clips))
        results.append(drop_placeholders(documents[-1]))
        assert len(glb_of(results[-1])) <= len(glb_of(documents[-1]))
        scenes = [reader.scene(each) for each in (documents[-1], results[-1])]
        for a, b in zip(*(scene.instances for scene in scenes), strict=True):
            np.testing.assert_array_equal(a.mesh.positions, b.mesh.positions)
            np.testing.assert_array_equal(a.mesh.faces, b.mesh.faces)
            np.testing.assert_array_equal(a.mesh.targets, b.mesh.targets)
    reports = validate_many([glb_of(each) for each in documents + results], limit=0)
    for before, after in zip(reports, reports[len(documents) :], strict=False):
        assert len(errors(after)) == len(errors(before))
    assert sum(each is not old for each, old in zip(results, documents, strict=True)) > 5


def _at(content: Json, place: str) -> Any:
    found: Any = content
    for key in place.split():
        found = found[int(key) if isinstance(found, list) else key]
    return found
