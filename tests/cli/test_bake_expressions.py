"""Expressions of VRM name no shapes of frames after a bake."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from anim.gltf.document import Document
from tests.cli.conftest import Call
from tests.files import glb_of, opened_fixture, opened_path


def _vrm_0(bind: dict[str, Any]) -> dict[str, Any]:
    return {"VRM": {"specVersion": "0.0", "blendShapeMaster": {"blendShapeGroups": [{"name": "A", "binds": [bind]}]}}}


def _vrm_1(bind: dict[str, Any]) -> dict[str, Any]:
    return {"VRMC_vrm": {"specVersion": "1.0", "expressions": {"preset": {"aa": {"morphTargetBinds": [bind]}}}}}


@pytest.mark.parametrize("layout", ["morph", "flip-visibility", "flip-scale"])
@pytest.mark.parametrize("version", [0, 1])
def test_bakes_have_no_binds_to_frames(
    version: int, layout: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Call
) -> None:
    monkeypatch.chdir(tmp_path)
    document = opened_fixture("pointer")
    bind = {"mesh": 0, "index": 1, "weight": 100} if version == 0 else {"node": 0, "index": 1, "weight": 1.0}
    extension = _vrm_0(bind) if version == 0 else _vrm_1(bind)
    named = [*document.json["extensionsUsed"], *extension]
    changed = {**document.json, "extensions": {**document.json.get("extensions", {}), **extension}}
    Path("a.glb").write_bytes(glb_of(Document({**changed, "extensionsUsed": named}, document.buffers)))
    run = call("bake", "a.glb", "out.glb", "--layout", layout, "--fps", "5", "--clip", "#0")
    run.product()
    assert "1 VRM expression without morph targets now" in run.err
    extensions = opened_path(tmp_path / "out.glb").json["extensions"]
    assert not any(word in json.dumps(extensions) for word in ('"mesh": 0', "morphTargetBinds"))
