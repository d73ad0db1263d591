"""`to-euler`, then `from-euler --onto` the same file: three.js, which is not ours, sees no difference."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Call, Find, Fixture
from tests.judge import judge, needs_judge

pytestmark = needs_judge

MAX_ERROR_M = 1e-5
LARGE_M = 10.0  # of the diagonal, above which the bound grows with it: float32 holds no 0.01 mm of 100 m
FRAMES = {"Knight.glb": 30, "Fox.glb": 120}  # grids that hold all keys; the others' lie on 24 frames per second


def _check(call: Call, path: Path, clip: str, fps: int, folder: Path) -> None:
    curves, back = folder / "curves.json", folder / "back.glb"
    assert call("to-euler", path, curves, "--clip", clip, "--fps", str(fps)).code == 0
    run = call("from-euler", curves, back, "--onto", path, "--replace", clip)
    assert run.code == 0, run.err
    found = judge(path, back)
    assert found.by_vertex
    assert (found.missing, found.extra, found.unmatched) == ((), (), ())
    assert found.max_error < MAX_ERROR_M * max(1.0, found.diagonal / LARGE_M), found.worst


def test_a_walk_comes_back(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    _check(call, fixture("biped"), "walk", 24, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "clip"),
    [
        ("Knight.glb", "Walking_A"),
        ("Knight.glb", "Death_A"),
        ("Knight.glb", "1H_Melee_Attack_Chop"),
        ("Robot.glb", "Robot_Jump"),
        ("Robot.glb", "Robot_Dance"),
        ("Fox.glb", "Run"),
        ("CesiumMan.glb", "#0"),
    ],
)
def test_clips_of_real_files_come_back(name: str, clip: str, call: Call, asset: Find, tmp_path: Path) -> None:
    _check(call, asset(name), clip, FRAMES.get(name, 24), tmp_path)
