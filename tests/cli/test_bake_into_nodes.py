"""Bakes into a glTF: nodes that share a mesh, mirrored nodes, interleaved attributes, and nothing left of the skin."""

from __future__ import annotations

import json as jsonlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.arrays import Ints
from anim.gltf.document import Document, copy_json
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.model import Mesh
from fixtures.broken import pieces
from tests.cli.conftest import Call
from tests.cli.test_bake_materials import baked
from tests.files import glb_of, opened, opened_fixture, opened_path


def meshes_of(document: Document) -> list[Mesh]:
    return [instance.mesh for instance in reader.scene(document).instances]


def oriented(faces: Ints) -> set[tuple[int, ...]]:
    """The faces that are no lines, each from its smallest vertex on."""
    rows = [row for row in faces.tolist() if len(set(row)) == 3]
    return {tuple(row[(row.index(min(row)) + i) % 3] for i in range(3)) for row in rows}


def test_nothing_of_the_skin_is_left(call: Call, textured_path: Path) -> None:
    """Bytes of joints, weights, binds and unused clips are gone."""
    document = baked(call, textured_path, "--clip", "bend")
    used = sum(each["byteLength"] for each in document.json["bufferViews"])
    assert used >= document.json["buffers"][0]["byteLength"] - 3 * len(document.json["bufferViews"])
    kinds = [(each["componentType"], each["type"]) for each in document.json["accessors"]]
    assert (5121, "VEC4") not in kinds
    assert (5126, "MAT4") not in kinds
    assert opened(glb_of(document)).json == document.json


@pytest.mark.parametrize("layout", ["flip-scale", "flip-visibility"])
def test_pages_of_a_mesh_that_nodes_share_are_their_own(call: Call, tmp_path: Path, layout: str) -> None:
    document = opened_fixture("morph_cube")
    json = copy_json(document.json)
    cube = next(node for node in json["nodes"] if "mesh" in node)
    json["nodes"].append({"mesh": cube["mesh"], "translation": [5, 0, 0]})
    json["scenes"][0]["nodes"].append(len(json["nodes"]) - 1)
    path = tmp_path / "two.glb"
    path.write_bytes(glb_of(replace(document, json=json)))
    pages = baked(call, path, "--clip", "#0", "--layout", layout, "--fps", "2").json["nodes"]
    meshes = [node["mesh"] for node in pages if "mesh" in node]
    assert len(set(meshes)) == len(meshes) > 2


@pytest.mark.parametrize("mode", [4, 5, 6])
@pytest.mark.parametrize("layout", ["morph", "flip-scale"])
def test_faces_of_a_mirrored_node_are_reversed(call: Call, tmp_path: Path, layout: str, mode: int) -> None:
    """Players reverse the winding of such a node; its vertices are now on another one, in world space."""
    path = tmp_path / "mirrored.glb"
    document = opened_fixture("morph_cube")
    json = copy_json(document.json)
    cube = next(i for i, node in enumerate(json["nodes"]) if "mesh" in node)
    for primitive in json["meshes"][json["nodes"][cube]["mesh"]]["primitives"]:
        primitive["mode"] = mode
    json["nodes"].append({"scale": [1, -1, 1], "children": [cube]})
    json["scenes"] = [{"nodes": [len(json["nodes"]) - 1]}]
    path.write_bytes(glb_of(replace(document, json=json)))
    faces = meshes_of(opened_path(path))[0].faces
    out = baked(call, path, "--clip", "#0", "--layout", layout)
    found = next(mesh for mesh in meshes_of(out) if len(mesh.positions)).faces
    assert oriented(found) == oriented(faces[:, ::-1])
    assert oriented(meshes_of(baked(call, path, "--clip", "#0", "--space", "mesh"))[0].faces) == oriented(faces)
    cache = tmp_path / "out.npz"
    assert call("bake", path, cache, "--clip", "#0").code == 0
    with np.load(cache) as arrays:
        assert oriented(arrays["faces"]) == oriented(faces[:, ::-1])


def test_interleaved_attributes_keep_whole_rows(call: Call, textured_path: Path) -> None:
    """three.js reads as many bytes as elements times the stride, from the row of the first element on."""
    document = opened_path(textured_path)
    json = copy_json(document.json)
    primitive = json["meshes"][0]["primitives"][0]["attributes"]
    names = ("JOINTS_0", "TEXCOORD_0", "POSITION")
    accessors = Accessors(document)
    columns = [accessors.raw(primitive[name]) for name in names]
    rows = np.concatenate(
        [np.ascontiguousarray(each).view(np.uint8).reshape(len(each), -1) for each in columns], axis=1
    )
    start = len(document.buffers[0].data)
    json["buffers"][0]["byteLength"] = start + rows.size
    view = {"buffer": 0, "byteOffset": start, "byteLength": rows.size, "byteStride": rows.shape[1], "target": 34962}
    json["bufferViews"].append(view)
    offset = 0
    for name, each in zip(names, columns, strict=True):
        about = json["accessors"][primitive[name]]
        about |= {"bufferView": len(json["bufferViews"]) - 1, "byteOffset": offset}
        offset += each[0].nbytes
    blob = bytes(document.buffers[0].data) + rows.tobytes()
    textured_path.write_bytes(pieces.glb(jsonlib.dumps(json).encode(), blob))
    out = baked(call, textured_path, "--clip", "bend").json
    kept = out["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]
    about = out["accessors"][kept]
    view = out["bufferViews"][about["bufferView"]]
    stride = view["byteStride"]
    assert stride == rows.shape[1]
    assert about["byteOffset"] // stride * stride + about["count"] * stride <= view["byteLength"]
