"""Expressions of VRM 0.x and 1.0 bind no morph targets that a bake replaced."""

from __future__ import annotations

from typing import Any

import pytest

from anim.caches.source_document.expression_binds import drop_binds, lost_bind_notes


def vrm_0(binds: list[Any]) -> dict[str, Any]:
    group = {"name": "Blink", "binds": binds, "materialValues": []}
    return {"VRM": {"specVersion": "0.0", "blendShapeMaster": {"blendShapeGroups": [group]}}}


def vrm_1(expression: dict[str, Any]) -> dict[str, Any]:
    return {"VRMC_vrm": {"specVersion": "1.0", "expressions": {"preset": {"blink": expression}, "custom": {}}}}


def test_binds_of_meshes_that_stay_are_kept() -> None:
    kept, gone = {"mesh": 1, "index": 0, "weight": 100}, {"mesh": 0, "index": 2, "weight": 100}
    source: dict[str, Any] = {"meshes": [{"name": "a"}, {"name": "b"}], "extensions": vrm_0([gone, kept])}
    edited = {**source, "meshes": [{"name": "baked"}, source["meshes"][1]]}
    drop_binds(edited, source, {0})
    assert edited["extensions"] == vrm_0([kept])
    assert source["extensions"] == vrm_0([gone, kept])
    assert lost_bind_notes(source, edited)
    assert not lost_bind_notes(source, source)


def test_binds_of_nodes_that_stay_are_kept() -> None:
    kept, gone = {"node": 1, "index": 0, "weight": 1.0}, {"node": 0, "index": 2, "weight": 1.0}
    old = {"isBinary": True, "morphTargetBinds": [gone, kept]}
    source: dict[str, Any] = {"meshes": [{}], "extensions": vrm_1(old)}
    edited = dict(source)
    drop_binds(edited, source, {0})
    assert edited["extensions"] == vrm_1({"isBinary": True, "morphTargetBinds": [kept]})
    drop_binds(edited, source, {1})
    assert edited["extensions"] == vrm_1({"isBinary": True})


def test_what_is_no_bind_stays() -> None:
    source: dict[str, Any] = {"meshes": [{}], "extensions": vrm_1({"morphTargetBinds": [{"node": [0]}, {"node": 0}]})}
    edited = dict(source)
    drop_binds(edited, source, {0})
    assert edited["extensions"] == vrm_1({"morphTargetBinds": [{"node": [0]}]})
    groups = [None, {"binds": [{"mesh": 0}]}]
    source = {"meshes": [{}], "extensions": {"VRM": {"blendShapeMaster": {"blendShapeGroups": groups}}}}
    edited = {**source, "meshes": [{"name": "baked"}]}
    drop_binds(edited, source, {0})
    new = edited["extensions"]["VRM"]["blendShapeMaster"]["blendShapeGroups"]
    assert (len(new), new[0], new[1].get("binds", [])) == (2, None, [])


@pytest.mark.parametrize("extension", [{}, 0.5, vrm_0([]), vrm_1({}), {"VRM": 3}, {"VRM": {"blendShapeMaster": []}}])
def test_documents_without_binds_are_unchanged(extension: object) -> None:
    source: dict[str, Any] = {"meshes": [{}], "extensions": extension}
    edited = {**source, "meshes": [{"name": "baked"}]}
    drop_binds(edited, source, {0})
    assert edited["extensions"] is extension
    assert not lost_bind_notes(source, edited)
