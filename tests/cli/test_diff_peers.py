"""`diff` against three.js, and on what peers write."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Call, Find
from tests.judge import judge, needs_judge


@needs_judge
def test_three_says_the_same(asset: Find, tmp_path: Path, call: Call) -> None:
    run = call("resample", asset("Fox.glb"), tmp_path / "b.glb", "--fps", "12")
    assert run.code == 0
    verdict = judge(asset("Fox.glb"), tmp_path / "b.glb")
    found = call("diff", asset("Fox.glb"), tmp_path / "b.glb", "--format", "json", "--player", "three").json
    assert found["diagonal_m"] == pytest.approx(verdict.diagonal, rel=1e-5)
    by_name = {each["clip"]: each for each in found["clips"]}
    for each in verdict.clips:
        assert by_name[each.name]["max_error_m"] == pytest.approx(each.max_error, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Fox.glb", "Robot.glb"])
def test_what_gltfpack_does_by_default_is_seen(name: str, asset: Find, tmp_path: Path, call: Call) -> None:
    """30 frames a second, joints without names, quantized and reordered vertices: seen as motion only where it is."""
    default = _peer(tmp_path, "gltfpack", "-i", asset(name), "-o", tmp_path / "default.glb")
    same_keys = _peer(tmp_path, "gltfpack", "-i", asset(name), "-o", tmp_path / "keys.glb", "-kn", "-af", "0", "-cc")
    found: list[dict[str, Any]] = [
        call("diff", asset(name), path, "--format", "json").json for path in (default, same_keys)
    ]
    assert found[0]["max_error_percent"] > (8 if name == "Robot.glb" else 1)
    assert found[1]["max_error_percent"] < 0.2  # 12 bits
    assert not found[1]["meshes_agree_by_vertex"]
    assert call("diff", asset(name), default, "--fail-above", "1%").code == 6


@pytest.mark.slow
def test_quantized_meshes_are_not_motion(asset: Find, tmp_path: Path, call: Call) -> None:
    quantized = _peer(tmp_path, "gltf-transform", "quantize", asset("Fox.glb"), tmp_path / "q.glb")
    found = call("diff", asset("Fox.glb"), quantized, "--format", "json").json
    assert found["meshes_agree_by_vertex"]
    assert found["max_error_percent"] < 1e-5


def _peer(folder: Path, program: str, *args: str | Path) -> Path:
    """Run a peer's command that writes a GLB into the folder; skip where the peer is not installed."""
    packages = Path(os.environ.get("GLTF_VALIDATOR_DIR", "node_modules"))
    path = shutil.which(program, path=f"{packages / '.bin'}{os.pathsep}{os.environ['PATH']}")
    if path is None:
        pytest.skip(f"{program} is not installed")
    subprocess.run([path, *map(str, args)], check=True, capture_output=True)
    return next(Path(arg) for arg in args if str(arg).startswith(str(folder)))
