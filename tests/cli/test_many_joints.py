"""Files with a skin of many joints: a node that is a joint again and again is looked at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from anim.maths import matrix
from anim.measure.compare import mesh_space
from anim.skinning import bound_mesh
from tests.calls import count_calls
from tests.cli.conftest import Call
from tests.cli.running import refusal
from tests.cli.test_memory_limit import of_joints


def test_equal_joints_of_two_files_are_paired_at_once(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.gltf").write_bytes(of_joints(1000))
    counted = count_calls(monkeypatch, matrix, "multiply")
    spaces = count_calls(monkeypatch, mesh_space, "from_binds")
    call("diff", tmp_path / "in.gltf", tmp_path / "in.gltf").product()
    assert len(spaces) == 1
    assert len(counted) < 50


def test_matrices_of_many_joints_are_multiplied_in_blocks(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.gltf").write_bytes(of_joints(1000))
    made = []
    for block in (10**5, 70):
        monkeypatch.setattr(bound_mesh, "MAX_BLOCK_MATRICES", block)
        path = tmp_path / f"{block}.npz"
        call("bake", tmp_path / "in.gltf", path, "--fps", "4").product()
        made.append(np.load(path)["positions"])
    np.testing.assert_array_equal(*made)


def test_the_bind_pose_of_a_joint_is_found_once(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "in.gltf").write_bytes(of_joints(1000))
    counted = count_calls(monkeypatch, matrix, "multiply")
    call("to-euler", tmp_path / "in.gltf", tmp_path / "out.bvh").product()
    assert len(counted) < 50


def test_inverse_binds_for_usd_are_checked_at_once(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pxr", reason="usd-core is not installed")
    (tmp_path / "in.gltf").write_bytes(of_joints(1000))
    counted = count_calls(monkeypatch, np.linalg, "svd")
    call("convert", tmp_path / "in.gltf", tmp_path / "out.usda").product()
    assert 0 < len(counted) < 50


def test_too_many_joints_are_refused_before_they_are_posed(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.gltf").write_bytes(of_joints(1000))
    counted = count_calls(monkeypatch, bound_mesh.BoundMesh, "matrices")
    assert "would take" in refusal(call("collapse", tmp_path / "in.gltf", "--memory-limit", "5MB"), 4)
    assert not counted
