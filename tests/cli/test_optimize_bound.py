"""The bound of `optimize` on real files, judged by three.js: nothing of `anim` measures here."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.files import REAL
from tests.judge import Verdict, judge, needs_judge

pytestmark = [needs_judge, pytest.mark.slow]

Find = Callable[[str], Path]
BOUNDS = (1e-3, 1e-4, 1e-5)  # of the diagonal
COMMAND = Path(sys.executable).parent / "gltf-anim"
LARGE = ("BusterDrone/busterDrone.gltf", "Knight.glb", "Robot.glb")  # searched less; they are verified all the same


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("name", REAL)
def test_no_vertex_of_any_real_file_moves_further(asset: Find, name: str, bound: float, tmp_path: Path) -> None:
    _hold(asset(name), bound, tmp_path, "--drop", "rest", "--effort", "fast" if name in LARGE else "balanced")


@pytest.mark.parametrize("mode", ["ext", "khr"])
@pytest.mark.parametrize("name", ["Fox.glb", "CesiumMan.glb", "Robot.glb", "BitmojiRun.glb", "MorphStressTest.glb"])
def test_no_vertex_moves_further_under_a_codec(asset: Find, name: str, mode: str, tmp_path: Path) -> None:
    _hold(asset(name), 1e-4, tmp_path, "--meshopt", mode, "--effort", "fast" if name in LARGE else "balanced")


def test_no_vertex_moves_further_from_another_rest_pose(asset: Find, tmp_path: Path) -> None:
    _hold(asset("Robot.glb"), 3e-4, tmp_path, "--rebase-rest", "--meshopt", "ext")


def _hold(source: Path, bound: float, folder: Path, *options: str) -> None:
    """Optimize, and let the judge say that the bound was kept, every clip is there, and no mesh was touched."""
    output = folder / "out.glb"
    call = [COMMAND, "optimize", source, output, "--max-error", f"{100 * bound:.10g}%", *options]
    run = subprocess.run([*map(str, call)], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    found: Verdict = judge(source, output)
    assert found.share <= bound, found.worst
    assert found.by_vertex
    assert (found.missing, found.extra, found.unmatched) == ((), (), ())
    assert [clip.other for clip in found.clips] == [clip.name for clip in found.clips]
    assert [clip.other_duration for clip in found.clips] == [clip.duration for clip in found.clips]
