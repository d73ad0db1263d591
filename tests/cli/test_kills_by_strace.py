"""A run that the system kills within each of its calls that change files: the output is the old one or the new one.

`test_kills` stops runs before Python's file operations; here strace kills them within the calls of the system.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.running import ENVIRONMENT, ROOT, TIMEOUT
from tests.cli.test_kills import contents, meaning, pair_in_place, pair_over_a_pair, pc2

CALLS = ("rename", "link", "unlink", "chmod", "utimensat", "flock", "ftruncate")
MAX_CALLS = 30
KILLED = (-9, 137)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("strace") is None, reason="strace is not there"),
]


def killed_runs(before: Path, out: Path, call: str, line: list[str]) -> list[Path]:
    """Return a folder for each run that was killed within a call of this kind, and of the last, which was not."""
    folders = []
    for number in range(1, MAX_CALLS):
        folder = shutil.copytree(before, out / f"{call}-{number}")
        kill = ["strace", "-f", "-qq", "-o", "/dev/null", "-e", f"inject=/^{call}:signal=KILL:when={number}"]
        command = [*kill, sys.executable, "-m", "anim", *line, "-q"]
        environment = {**ENVIRONMENT, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
        run = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, timeout=2 * TIMEOUT, check=False
        )
        assert run.returncode in (0, *KILLED), run.stderr
        folders.append(folder)
        if run.returncode == 0:
            return folders
    raise AssertionError("no end")


@pytest.mark.parametrize("case", [pair_in_place, pair_over_a_pair], ids=lambda case: case.__name__)
def test_a_pair_that_is_killed_in_a_call(case: Callable[[Path], list[str]], walk: Path, tmp_path: Path) -> None:
    before = tmp_path / "before"
    before.mkdir()
    walk.rename(before / "walk.glb")
    line = case(before)
    old, target = contents(before), line[2]
    runs = {call: killed_runs(before, tmp_path, call, line) for call in CALLS}
    assert sum(map(len, runs.values())) > len(CALLS) + 2
    new = contents(runs["rename"][-1])
    assert meaning(target, new) != meaning(target, old)
    for folders in runs.values():
        for folder in folders:
            assert meaning(target, contents(folder)) in (meaning(target, old), meaning(target, new))


def test_a_cache_that_is_killed_in_a_call(walk: Path, tmp_path: Path) -> None:
    before = tmp_path / "before"
    before.mkdir()
    walk.rename(before / "walk.glb")
    line = pc2(before)
    old = contents(before)
    runs = {call: killed_runs(before, tmp_path, call, line) for call in ("rename", "unlink")}
    new = contents(runs["rename"][-1])
    for folders in runs.values():
        for folder in folders:
            now = contents(folder)
            if "c.pc2" in now:
                assert now in (old, new)
