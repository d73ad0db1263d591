"""Meshes without a node are removed, and pointers name the others by their new index."""

from __future__ import annotations

from typing import Any

import pytest

from anim.caches.source_document.excluded_meshes import drop_meshes


def channel(pointer: str) -> dict[str, Any]:
    return {"sampler": 0, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}}


def test_nodes_and_pointers_are_renumbered() -> None:
    json: dict[str, Any] = {"meshes": [{"name": name} for name in "abc"], "nodes": [{"mesh": 2}, {}, {"mesh": 0}]}
    node = {"sampler": 0, "target": {"node": 2, "path": "translation"}}
    clip = {"channels": [channel("/meshes/2/weights/0"), channel("/meshes/1/extras/x"), node]}
    drop_meshes(json, {0, 1}, clip)
    assert json == {"meshes": [{"name": "a"}, {"name": "c"}], "nodes": [{"mesh": 1}, {}, {"mesh": 0}]}
    assert clip["channels"] == [channel("/meshes/1/weights/0"), node]


@pytest.mark.parametrize("extension", ["ACME", "VRM", "KHR_physics_rigid_bodies"])
def test_an_extension_that_may_name_a_mesh_keeps_all(extension: str) -> None:
    """Also where it names no accessors."""
    json: dict[str, Any] = {"meshes": [{}, {}], "nodes": [{"mesh": 1}], "extensions": {extension: {"mesh": 1}}}
    drop_meshes(json, {0}, {"channels": []})
    assert len(json["meshes"]) == 2
