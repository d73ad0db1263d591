"""Compiled kernels: late, kept in the user's cache folder, and the same as their own Python."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from anim.skinning import compiled as compiled_module
from anim.skinning import kept
from anim.skinning.compiled import compiled
from anim.skinning.kernels import rows
from anim.skinning.kernels.around_duals import around_duals
from anim.skinning.kernels.lanes import LANES, Held, Shape, Target, room
from anim.skinning.kernels.normals_of_faces import normals_of_faces
from anim.skinning.kernels.rigid_turns import rigid_turns
from anim.skinning.machine_code import MachineCode, kinds

ROOT = Path(__file__).resolve().parents[3]
OWN_LOADER = (sys.platform, platform.machine()) == ("linux", "x86_64")
HEAVY = ("numba", "llvmlite") if OWN_LOADER else ("numba",)
SCRIPT = """
import sys
from anim.skinning.bake import bake
assert not any(each in sys.modules for each in ("numba", "llvmlite"))
from anim.model import Clip
from tests.anim.skinning.scenes import random_scene
import numpy as np
found = bake(random_scene(1), Clip("", ()), times=np.zeros(1)).whole().positions
print(any(each in sys.modules for each in {heavy}), found.tobytes().hex())
"""
ALL = """
import sys
import numpy as np
from anim.model import Clip
from anim.skinning.bake import bake
from anim.skinning.methods import SKINNING_METHODS
from tests.anim.skinning.scenes import random_scene
of, still = random_scene(1, stretch=0.3), Clip("", ())
for method in SKINNING_METHODS:
    for normals in (False, True):
        bake(of, still, times=np.zeros(1), method=method, normals=normals, bulge_clamp=method != "lbs").whole()
print("llvmlite" in sys.modules)
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


def test_arrays_of_any_layout_and_results_are_passed_as_python_does() -> None:
    random = np.random.default_rng(0)
    faces = random.integers(0, 20, (30, 3))
    wide = random.normal(size=(2, 40, 3)).astype(np.float32)
    for positions in (wide[:, :20], wide[:, ::2], np.asfortranarray(wide[:, ::2]), wide[:1, :20]):
        plain, fast = (np.full((len(positions), 40, 3), 9, np.float32) for _ in range(2))
        normals_of_faces(faces, positions, plain[:, 1::2])
        compiled(normals_of_faces)(faces, positions, fast[:, 1::2])
        assert np.allclose(plain, fast, rtol=1e-5, atol=1e-5)
        assert (fast[:, ::2] == 9).all(), "nothing but the view"
    turn = np.eye(3, 4)[None, None]
    for size, tolerance, rigid in ((1.0, 1e-6, True), (1.1, 1e-6, False), (1.1, 1.0, True)):
        assert bool(compiled(rigid_turns)(size * turn, tolerance, np.empty((1, 1, 4)))) is rigid


def test_code_is_kept_in_the_users_cache_and_then_needs_no_numba(tmp_path: Path) -> None:
    made, found = _run(tmp_path), _run(tmp_path)
    assert (made[0], found[0]) == ("True", "False")
    assert made[1] == found[1]
    (folder,) = tmp_path.iterdir()
    assert folder.name == "gltf-anim"
    assert {path.name.partition("-")[0] for path in folder.iterdir()} == {"worlds", "points_only"}


@pytest.mark.skipif(not OWN_LOADER, reason="elsewhere LLVM loads all")
def test_every_kernel_is_loaded_without_llvm() -> None:
    """In a second process, as the first may have had to make it."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    for _ in range(2):
        run = subprocess.run([sys.executable, "-c", ALL], cwd=ROOT, env=environment, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
    assert run.stdout.split() == ["False"]


def test_code_is_made_for_one_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = compiled_module._digest(around_duals, "")
    monkeypatch.setattr(compiled_module, "machine", lambda: ("linux", "x86_64", "flags: fpu"))
    assert compiled_module._digest(around_duals, "") != usual


def test_code_that_is_not_whole_is_made_again(tmp_path: Path) -> None:
    wanted = _run(tmp_path)
    for path in (tmp_path / "gltf-anim").iterdir():
        content = path.read_bytes()
        path.write_bytes(content[:-100] if path.name.startswith("worlds") else b"")
    assert _run(tmp_path) == wanted
    assert _run(tmp_path)[0] == "False", "and kept"


def test_a_change_in_what_a_kernel_calls_is_other_code() -> None:
    """Numba alone would take the old code from the cache: it looks at the kernel's own file."""
    before = compiled_module._digest(around_duals, "")
    usual = rows.turn.__code__
    try:
        rows.turn.__code__ = rows.clear.__code__.replace(co_name="turn", co_varnames=usual.co_varnames[:3])
        assert compiled_module._digest(around_duals, "") != before
    finally:
        rows.turn.__code__ = usual
    assert compiled_module._digest(around_duals, "") == before


def test_other_types_or_layouts_are_other_code() -> None:
    array = np.zeros((2, 3))
    views = [array, array[:1], array.T, array[:, ::2], array[0], array.astype(np.float32)]
    likes = [*views, 1, 1.0, (1, array), Held(*views[:3])]
    found = [kinds([each]) for each in likes]
    assert found[0] == found[1], "sizes don't count"
    assert len(set(found)) == len(found) - 1
    array.flags.writeable = False
    assert kinds([array]) != found[0]


def test_without_a_cache_folder_it_works_all_the_same(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_bytes(b"")
    assert _run(blocked)[0] == "True"
    assert blocked.read_bytes() == b""


def test_a_user_without_a_home_is_no_reason_to_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    """A container's user may have neither $HOME nor an entry that says where it is."""

    def nowhere() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", nowhere)
    kept.write("name", MachineCode("symbol", b"code"))
    assert kept.read("name") is None


def test_what_could_not_be_kept_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    (tmp_path / "name").mkdir()  # in the way
    kept.write("name", MachineCode("symbol", b"code"))
    assert [path.name for path in tmp_path.iterdir()] == ["name"]
    kept.write("other", MachineCode("symbol", b"code"))
    assert kept.read("other") == MachineCode("symbol", b"code")


def _run(cache: Path) -> list[str]:
    """Whether numba was there in the end, and the bytes of what was baked."""
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    environment |= {"XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(ROOT)}
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(heavy=HEAVY)], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.split()


@pytest.mark.parametrize("problem", [AttributeError("no such thing in this numba"), RuntimeError("no such format")])
def test_a_numba_with_other_insides_runs_the_kernels_itself(
    problem: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def foreign(*_: object) -> None:
        raise problem

    monkeypatch.setattr(compiled_module, "_code", foreign)
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    positions = np.random.default_rng(0).normal(size=(2, 4, 3)).astype(np.float32)
    plain, fast = (np.zeros((2, 4, 3), np.float32) for _ in range(2))
    normals_of_faces(faces, positions, plain)
    compiled.__wrapped__(normals_of_faces)(faces, positions, fast)
    assert np.allclose(plain, fast, atol=1e-5)
    assert plain.any()
