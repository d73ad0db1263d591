"""Hooks of .pre-commit-hooks.yaml, installed by `pre-commit try-repo` from this checkout; needs the index of pip."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.cli.running import ROOT, built

PROGRAM = os.environ.get("PRE_COMMIT") or shutil.which("pre-commit")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(PROGRAM is None, reason="pre-commit is not installed"),
    pytest.mark.skipif(not (ROOT / ".git").exists(), reason="this is no checkout"),
]


def try_hook(hook: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PRE_COMMIT_HOME": str(folder.parent / "hooks")}
    environment.pop("PYTHONPATH", None)
    call = [str(PROGRAM), "try-repo", str(ROOT), hook, "--all-files", "--verbose"]
    return subprocess.run(call, cwd=folder, env=environment, capture_output=True, text=True)


def test_hooks_check_and_fix(tmp_path: Path) -> None:
    folder = tmp_path / "repository"
    folder.mkdir()
    name = "walk cycle.glb"
    (folder / name).write_bytes(built("noop"))
    (folder / "text.txt").write_text("no glTF")
    subprocess.run(["git", "init", "-q", "."], cwd=folder, check=True)
    subprocess.run(["git", "add", "."], cwd=folder, check=True)
    done = try_hook("gltf-anim-check", folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 file checked: 0 errors" in done.stdout
    fixed = try_hook("gltf-anim-fix", folder)
    assert "files were modified by this hook" in fixed.stdout
    after = (folder / name).read_bytes()
    subprocess.run(["git", "add", "."], cwd=folder, check=True)
    again = try_hook("gltf-anim-fix", folder)
    assert again.returncode == 0, again.stdout
    assert (folder / name).read_bytes() == after
    (folder / name).write_bytes(b"no glTF")
    assert try_hook("gltf-anim-check", folder).returncode == 1
