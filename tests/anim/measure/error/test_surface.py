"""Surfaces: the vertices of a scene, where they are, and how far apart."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import fixtures
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.error.surface import SHELL, diagonal, place_points, surfaces
from anim.model import Scene
from anim.sampling import rest_world
from fixtures.broken.pieces import buffered, data_uri, text
from tests.clips import skeleton
from tests.files import opened, opened_fixture, opened_path

Find = Callable[[str], Path]
Json = dict[str, Any]


@pytest.mark.parametrize(
    ("name", "length"),
    [
        ("tube", np.sqrt(0.2**2 + 1 + 0.2**2)),  # radius 0.1 m, 1 m high
        ("noop", np.sqrt(3) * 0.4),  # a cube
        ("morph_cube", np.sqrt(1.125**2 + 1 + 1)),  # at rest a quarter of the second target leans it by 1/8 m
    ],
)
def test_diagonals_by_hand(name: str, length: float) -> None:
    assert diagonal(reader.scene(opened_fixture(name))) == pytest.approx(length, rel=1e-6)


@pytest.mark.parametrize("name", ["interpolations", "pointer", "accessors"])
def test_diagonals_of_rigid_fixtures_are_those_of_trimesh(name: str) -> None:
    """Without skins and weights another loader's scene has the same bounds."""
    loaded: Any = trimesh.load(io.BytesIO(fixtures.build(name)), file_type="glb", process=False)
    assert diagonal(reader.scene(opened_fixture(name))) == pytest.approx(float(loaded.scale), rel=1e-6)


def test_the_biped_stands_where_its_mesh_was_bound() -> None:
    scene = reader.scene(opened_fixture("biped"))
    positions = np.concatenate([instance.mesh.positions for instance in scene.instances])
    assert diagonal(scene) == pytest.approx(np.linalg.norm(np.ptp(positions, axis=0)), rel=1e-6)


def test_real_models_have_their_known_sizes(asset: Find) -> None:
    """Heights that players show: the man is 1.5 m, the fox about 79 of its units."""
    for name, height in (("CesiumMan.glb", 1.5), ("Fox.glb", 79)):
        scene = reader.scene(opened_path(asset(name)))
        world = rest_world(scene.skeleton)
        (surface,) = surfaces(scene)
        points = place_points(surface, world[surface.nodes], surface.rest_weights)
        assert np.ptp(points[:, 1]) == pytest.approx(height, rel=0.01)


def test_nodes_stand_in_for_vertices_only_where_there_are_none() -> None:
    nodes = skeleton([-1, 0, 1], translation=[[0, 0, 0], [3, 0, 0], [0, 4, 0]])
    scene = Scene(nodes, ())
    assert diagonal(scene) == pytest.approx(5)
    found = surfaces(scene)
    assert [surface.name for surface in found] == ["0", "1", "2"]
    for surface in found:
        assert np.abs(surface.points).tolist() == [[5 * SHELL] * 3] * 8
    assert [surface.name for surface in surfaces(reader.scene(opened_fixture("morph_cube")))] == ["cube"]


def test_a_mesh_without_vertices_counts_as_none() -> None:
    content = {"nodes": [{"mesh": 0}, {"translation": [1, 0, 0]}], "meshes": [{"primitives": [{"attributes": {}}]}]}
    scene = reader.scene(opened(text(content)))
    assert diagonal(scene) == 1
    assert len(surfaces(scene)) == 2


def test_a_single_point_has_no_size() -> None:
    content = buffered(("VEC3", 5126, [[7, 8, 9]]))
    content |= {"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}]}
    assert diagonal(reader.scene(opened(text(content)))) == 0


def test_skinned_meshes_ignore_their_own_node() -> None:
    document = opened_fixture("arm")
    nodes = document.json["nodes"]
    number = next(i for i, node in enumerate(nodes) if "skin" in node)
    moved = [{**node, "translation": [9, 9, 9]} if i == number else node for i, node in enumerate(nodes)]
    other = opened(text({**document.json, "nodes": moved, "buffers": _inline(document)}))
    assert diagonal(reader.scene(other)) == diagonal(reader.scene(document))


def _inline(document: Document) -> list[Json]:
    return [{"byteLength": len(b.data), "uri": data_uri(b.data.tobytes())} for b in document.buffers]
