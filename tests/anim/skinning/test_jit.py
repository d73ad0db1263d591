"""Compiled kernels: late, cached for one version and its sources, and the same as their own Python."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from anim import __version__
from anim.skinning.kernels import jit
from anim.skinning.kernels.dual_quaternion import skin_dual_quaternion
from anim.skinning.kernels.layout import LANES, Influences, ScaleShear, group_influences
from anim.skinning.kernels.vertex_normals import vertex_normals

ROOT = Path(__file__).resolve().parents[3]
SCRIPT = """
import sys
from anim.skinning.bake import bake
assert "numba" not in sys.modules
from anim.model import Clip
from tests.anim.skinning.scenes import random_scene
import numpy as np
print(bake(random_scene(1), Clip("", ()), times=np.zeros(1)).load_all().positions.tobytes().hex())
"""


def _python(kernel: Any) -> Any:
    """The Python that a kernel is compiled from; what it calls stays compiled."""
    return kernel.py_func


@pytest.mark.parametrize("stretched", [False, True])
def test_machine_code_is_the_python_it_came_from(stretched: bool) -> None:
    random = np.random.default_rng(0)

    def values(*shape: int) -> Any:
        return random.normal(size=shape).astype(np.float32)

    points, normals, tangents = values(5, 3, 1), values(5, 3, 1), values(5, 3, 1)
    joint, start = np.array([0, 1, 2, 3, 1, 2], np.int32), np.array([0, 2, 3, 3, 5, 6])
    held = group_influences(Influences(np.array([0.7, 0.3, 1, 0.6, 0.4, 1], np.float32), joint, start, 2))
    duals = values(4, 12 if stretched else 8, LANES)
    stretches = ScaleShear(values(4, 15, LANES), values(4, 1, LANES), held) if stretched else None
    results = []
    for kernel in (_python(skin_dual_quaternion), skin_dual_quaternion):
        out = (np.full((2, 7, 3), np.float32(9)), np.full((2, 7, 3), np.float32(9)), np.full((2, 7, 3), np.float32(9)))
        kernel(points, normals, tangents, held, duals, stretches, 1, 5, 2, out)
        assert all((each[:, [0, 1, 2]] == 9).all() for each in out), "only what was asked for"
        results.append(out)
    for plain, fast in zip(*results, strict=True):
        assert np.allclose(plain, fast, rtol=1e-5, atol=1e-5)


def test_views_are_written_through() -> None:
    random = np.random.default_rng(0)
    faces = random.integers(0, 20, (30, 3))
    wide = random.normal(size=(2, 40, 3)).astype(np.float32)
    for positions in (wide[:, :20], wide[:, ::2], np.asfortranarray(wide[:, ::2]), wide[:1, :20]):
        plain, fast = (np.full((len(positions), 40, 3), 9, np.float32) for _ in range(2))
        _python(vertex_normals)(faces, positions, plain[:, 1::2])
        vertex_normals(faces, positions, fast[:, 1::2])
        assert np.allclose(plain, fast, rtol=1e-5, atol=1e-5)
        assert (fast[:, ::2] == 9).all(), "nothing but the view"


def test_influences_come_in_groups_of_four() -> None:
    weight, joint = np.array([0.7, 0.3, 1, 0.2, 0.2, 0.2, 0.2, 0.2], np.float32), np.arange(8, dtype=np.int32)
    found = group_influences(Influences(weight, joint, np.array([0, 2, 2, 3, 8]), 5))
    assert found.start.tolist() == [0, 4, 4, 8, 16]
    assert found.weight.round(6).tolist() == pytest.approx([0.7, 0.3, 0, 0, 1, 0, 0, 0, *[0.2] * 5, 0, 0, 0])
    assert found.joint.tolist() == [0, 1, 0, 0, 2, 2, 2, 2, 3, 4, 5, 6, 7, 3, 3, 3]
    assert found.max_count == 8


@pytest.mark.slow
def test_code_is_cached_for_one_version_and_set_of_sources(tmp_path: Path) -> None:
    """Numba looks at a kernel's own file only, and would go on with what an older helper was compiled to."""
    first = _run(tmp_path)
    (folder,) = (tmp_path / "gltf-anim").iterdir()
    assert folder.name.startswith(f"{__version__}-")
    files = {path: path.stat().st_mtime_ns for path in folder.rglob("*.nb?")}
    assert files
    assert _run(tmp_path) == first
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*.nb?")} == files, "nothing was compiled again"


@pytest.mark.slow
def test_without_a_cache_folder_it_works_all_the_same(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_bytes(b"")
    assert _run(blocked) == _run(tmp_path / "other")


@pytest.mark.skipif(os.name != "posix", reason="has no such limit")
def test_a_disk_without_room_for_code_is_no_cache(tmp_path: Path) -> None:
    """Numba raises where it can't write: a bake would end by it."""
    code = "from anim.skinning.kernels import jit; print(jit._has_cache())"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    for blocks, found in (("unlimited", "True"), ("100", "False")):
        line = f'ulimit -f {blocks}; exec "{sys.executable}" -c "{code}"'
        done = subprocess.run(["bash", "-c", line], env=environment, capture_output=True, text=True, check=True)
        assert done.stdout.strip() == found
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="has no such modes")
@pytest.mark.parametrize(("mode", "is_used"), [(0o700, True), (0o755, True), (0o775, False), (0o1777, False)])
def test_code_that_others_may_have_put_there_is_not_run(
    mode: int, is_used: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    tmp_path.chmod(mode)
    assert jit._has_cache.__wrapped__() is is_used
    if os.geteuid() == 0:  # only root gives folders to others
        os.chown(tmp_path, 1234, 1234)
        assert not jit._has_cache.__wrapped__()


@pytest.mark.skipif(os.name != "posix", reason="has no such modes")
@pytest.mark.parametrize("through", ["path", "link"])
@pytest.mark.parametrize(
    ("mode", "is_used"), [(0o755, True), (0o775, False), (0o757, False), (0o1777, True), (0o1775, True)]
)
def test_code_in_a_folder_that_others_may_exchange_is_not_run(
    mode: int, is_used: bool, through: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder above it that others may write to, unless they may not rename in it what is not theirs (/tmp)."""
    above = tmp_path / "above"
    folder = above / "mine" / "code"
    folder.mkdir(mode=0o700, parents=True)
    if through == "link":  # in the folder that others may write to
        (tmp_path / "code").mkdir(mode=0o700)
        folder = above / "link"
        folder.symlink_to(tmp_path / "code")
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(folder))
    above.chmod(mode)
    assert jit._has_cache.__wrapped__() is is_used
    if os.geteuid() == 0:
        os.chown(above, 1234, 1234)
        assert not jit._has_cache.__wrapped__()


def _run(cache: Path) -> str:
    """The bytes of what a process of its own bakes."""
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    environment |= {"XDG_CACHE_HOME": str(cache), "LOCALAPPDATA": str(cache), "PYTHONPATH": str(ROOT)}
    run = subprocess.run([sys.executable, "-c", SCRIPT], cwd=ROOT, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return run.stdout
