"""Nodes that players rotate by VRMC_node_constraint: commands say that they do not, and keep what it needs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from anim.gltf.io import container
from tests.cli.conftest import Call
from tests.files import glb_of, opened_fixture

EXTENSION = "VRMC_node_constraint"
KEYS = ("translation", "rotation", "scale")


@pytest.mark.parametrize(
    "line",
    [
        ("resample", "rigged.glb", "out.glb", "--fps", "9"),
        ("bake", "rigged.glb", "{clip}.npz", "--fps", "4"),
        ("diff", "rigged.glb", "rigged.glb"),
    ],
)
def test_constraints_are_warned_of(
    line: tuple[str, ...], call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    _write(tmp_path / "rigged.glb")
    run = call(*line, "-q")
    assert run.code == 0, run.err
    assert f"has a constraint by {EXTENSION}, which is not evaluated" in run.err


def test_channels_of_a_source_without_vertices_stay(call: Call, tmp_path: Path) -> None:
    source = _write(tmp_path / "rigged.glb")
    plain = tmp_path / "plain.glb"
    plain.write_bytes(glb_of(_with_control(constrained=False)))
    options = ("--max-error", "1mm", "--effort", "fast", "--drop-invisible")
    for name, kept in (("rigged.glb", True), ("plain.glb", False)):
        call("optimize", tmp_path / name, tmp_path / "out.glb", *options).product()
        assert (source in _moved(tmp_path / "out.glb")) == kept


def test_a_rest_pose_that_extensions_use_stays(call: Call, tmp_path: Path) -> None:
    _write(tmp_path / "rigged.glb")
    before = container.read((tmp_path / "rigged.glb").read_bytes()).json["nodes"]
    run = call("optimize", tmp_path / "rigged.glb", tmp_path / "out.glb", "--effort", "fast", "--rebase-rest")
    assert run.code == 0
    assert f"the rest pose stays, since {EXTENSION} depends on it" in run.err
    after = container.read((tmp_path / "out.glb").read_bytes()).json["nodes"]
    assert [[node.get(key) for key in KEYS] for node in after] == [[node.get(key) for key in KEYS] for node in before]


def _write(path: Path) -> int:
    """Write a file with a constrained node, and return the source of the constraint."""
    document = _with_control(constrained=True)
    path.write_bytes(glb_of(document))
    return len(document.json["nodes"]) - 1


def _with_control(*, constrained: bool) -> Any:
    """The arm with a node that nothing is bound to, which moves like a joint; a mesh node copies its rotation."""
    document = opened_fixture("arm")
    content = json.loads(json.dumps(document.json))
    control = len(content["nodes"])
    content["nodes"].append({"name": "control"})
    content["scenes"][0]["nodes"].append(control)
    for each in content["animations"]:
        sampler = next(c["sampler"] for c in each["channels"] if c["target"]["path"] == "rotation")
        each["channels"].append({"sampler": sampler, "target": {"node": control, "path": "rotation"}})
    if constrained:
        content["extensionsUsed"] = [EXTENSION]
        about = {"specVersion": "1.0", "constraint": {"rotation": {"source": control}}}
        content["nodes"][0]["extensions"] = {EXTENSION: about}
    return replace(document, json=content)


def _moved(path: Path) -> set[int]:
    """The nodes with channels."""
    content = container.read(path.read_bytes()).json
    return {channel["target"]["node"] for each in content["animations"] for channel in each["channels"]}
