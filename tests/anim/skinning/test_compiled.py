"""Compiled kernels: late, kept in the user's cache folder, and the same as their own Python."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from anim.skinning import compiled as compiled_module
from anim.skinning.compiled import compiled
from anim.skinning.kernels import rows
from anim.skinning.kernels.around_duals import around_duals
from anim.skinning.kernels.lanes import LANES, Held, Shape, Target, room

ROOT = Path(__file__).resolve().parents[3]
SCRIPT = """
import sys
from anim.skinning.bake import bake
assert "numba" not in sys.modules
from anim.model import Clip
from tests.anim.skinning.scenes import random_scene
import numpy as np
bake(random_scene(1), Clip("", ()), times=np.zeros(1)).whole()
assert "numba" in sys.modules
"""


def test_machine_code_is_the_python_it_came_from() -> None:
    random = np.random.default_rng(0)
    points = random.normal(size=(5, 3, 1)).astype(np.float32)
    normals = random.normal(size=(5, 3, 1)).astype(np.float32)
    tangents = random.normal(size=(5, 3, 1)).astype(np.float32)
    duals = random.normal(size=(4, 8, LANES)).astype(np.float32)
    stretches = random.normal(size=(4, 12, LANES)).astype(np.float32)
    joint, start = np.array([0, 1, 2, 3, 1, 2], np.int32), np.array([0, 2, 3, 3, 5, 6])
    weight = np.array([0.7, 0.3, 1, 0.6, 0.4, 1], np.float32)
    results = []
    for kernel in (around_duals, compiled(around_duals)):
        out, turned, along = (np.full((2, 7, 3), 9, np.float32) for _ in range(3))
        shape, held, into = Shape(points, normals, tangents), Held(weight, joint, start), Target(2, out, turned, along)
        kernel(shape, held, duals, stretches, 1, 5, room(2), into)
        assert (out[:, [0, 1, 2]] == 9).all(), "only what was asked for"
        results.append((out, turned, along))
    for plain, fast in zip(*results, strict=True):
        assert np.allclose(plain, fast, rtol=1e-5, atol=1e-5)


def test_code_is_kept_in_the_users_cache_and_not_beside_the_package(tmp_path: Path) -> None:
    _run(tmp_path)
    kept = {path.name.partition("-")[0] for path in tmp_path.rglob("*.nbi")}
    assert "points_only.points_only" in kept
    assert all((tmp_path / "gltf-anim") in path.parents for path in tmp_path.rglob("*.nbi"))
    assert not list((ROOT / "anim" / "skinning").rglob("*.nbi"))


def test_a_change_in_what_a_kernel_calls_is_other_code() -> None:
    """Numba alone would take the old code from the cache: it looks at the kernel's own file."""
    before = compiled_module._digest(around_duals)
    kept = rows.turn.__code__
    try:
        rows.turn.__code__ = rows.clear.__code__.replace(co_name="turn", co_varnames=kept.co_varnames[:3])
        assert compiled_module._digest(around_duals) != before
    finally:
        rows.turn.__code__ = kept
    assert compiled_module._digest(around_duals) == before


def test_without_a_cache_folder_it_works_all_the_same(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_bytes(b"")
    _run(blocked)
    assert not list((ROOT / "anim" / "skinning").rglob("*.nbi"))


def _run(cache: Path) -> None:
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    environment |= {"XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(ROOT)}
    run = subprocess.run([sys.executable, "-c", SCRIPT], cwd=ROOT, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
