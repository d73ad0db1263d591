"""Meshes in copies by EXT_mesh_gpu_instancing: no bound is promised on copies that were not measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Call
from tests.cli.running import refusal
from tests.files import glb_of, opened_fixture

EXTENSION = "EXT_mesh_gpu_instancing"


@pytest.fixture
def required(tmp_path: Path) -> Path:
    """A file that no player may show without the copies."""
    path = tmp_path / "required.glb"
    path.write_bytes(with_copies("arm", "extensionsRequired"))
    return path


@pytest.mark.parametrize(
    "line",
    [
        ("optimize", "required.glb", "out.glb", "--max-error", "1mm"),
        ("diff", "required.glb", "required.glb", "--fail-above", "1mm"),
        ("bake", "required.glb", "out.npz"),
        ("collapse", "required.glb"),
    ],
)
def test_a_bound_on_required_copies_is_refused(
    line: tuple[str, ...], required: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(required.parent)
    assert f"copies of its mesh by {EXTENSION}, which is required and not read here" in refusal(call(*line), 4)
    assert not list(required.parent.glob("out.*"))


def test_keys_change_and_are_measured_at_nodes(required: Path, call: Call, tmp_path: Path) -> None:
    run = call("resample", required, tmp_path / "out.glb", "--fps", "9")
    assert run.code == 0
    assert "warning: measured at nodes, not on the surface" in run.err
    assert "(nodes only)" in run.err


def test_a_required_extension_that_no_mesh_uses_stops_nothing(call: Call, tmp_path: Path) -> None:
    document = opened_fixture("arm")
    path = tmp_path / "unused.glb"
    path.write_bytes(glb_of(replace(document, json={**document.json, "extensionsRequired": [EXTENSION]})))
    run = call("diff", path, path)
    assert run.code == 0
    assert run.err == ""


def with_copies(name: str, *lists: str) -> bytes:
    """Return a fixture whose meshes are shown in copies. lists: of the file's extensions, that name it."""
    document = opened_fixture(name)
    copies: dict[str, Any] = {"extensions": {EXTENSION: {"attributes": {}}}}
    nodes = [node | copies if "mesh" in node else node for node in document.json["nodes"]]
    used = {key: [EXTENSION] for key in ("extensionsUsed", *lists)}
    return glb_of(replace(document, json={**document.json, **used, "nodes": nodes}))
