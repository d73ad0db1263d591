"""Meshes and nodes added to a document."""

from __future__ import annotations

import numpy as np
import pytest

import anim
import fixtures
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.gltf.writing.append import append_mesh, append_nodes

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0]])
FACES = np.array([[0, 1, 2]])


def read_back(document: Document) -> Document:
    data = b"".join(bytes(piece) for piece in container.glb(document))
    return container.read(np.frombuffer(data, np.uint8))


@pytest.mark.parametrize("name", ["biped", "accessors", "pointer"])
def test_a_mesh_and_nodes_are_added_and_nothing_else_changes(name: str) -> None:
    old = container.read(np.frombuffer(fixtures.build(name), np.uint8))
    document, mesh = append_mesh(old, "spark", TRIANGLE, FACES, normals=TRIANGLE, material={"name": "glow"})
    document, nodes = append_nodes(document, [{"name": "a", "mesh": mesh}, {"name": "b", "mesh": mesh}])
    read = read_back(document)
    for key, value in old.json.items():
        if key not in ("buffers", "scenes"):
            assert read.json[key][: len(value)] == value if isinstance(value, list) else read.json[key] == value
    first = len(old.json["nodes"])
    assert nodes == [first, first + 1]
    assert read.json["scenes"][0]["nodes"] == [*old.json["scenes"][0]["nodes"], *nodes]
    new = reader.scene(read, normals=True).instances[-1].mesh
    assert (new.name, read.json["materials"][-1]["name"]) == ("spark", "glow")
    np.testing.assert_array_equal(new.positions, TRIANGLE)
    np.testing.assert_array_equal(new.faces, FACES)
    before, after = reader.scene(old), reader.scene(read)
    for a, b in zip(before.instances, after.instances, strict=False):
        np.testing.assert_array_equal(a.mesh.positions, b.mesh.positions)


def test_a_document_without_a_scene_gets_one() -> None:
    document, nodes = append_nodes(Document({"asset": {"version": "2.0"}}, ()), [{"name": "a"}])
    document, _ = append_mesh(document, "spark", TRIANGLE, FACES)
    read = anim.load(b"".join(bytes(piece) for piece in container.glb(document)))
    assert read.skeleton.names == ("a",)
    assert nodes == [0]
