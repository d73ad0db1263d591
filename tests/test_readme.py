"""Every command and the Python example in the README run as they stand there."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import fixtures

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "README.md").read_text()
COMMANDS = [
    line.split(" #")[0].strip()
    for block in re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL)
    for line in block.splitlines()
    if line.strip()
]
PYTHON = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for all commands: some read what an earlier one wrote, as a reader would."""
    folder = tmp_path_factory.mktemp("readme")
    for name in ("biped", "tube"):
        (folder / f"{name}.glb").write_bytes(fixtures.build(name))
    return folder


@pytest.mark.parametrize("command", COMMANDS)
def test_command_runs(command: str, folder: Path) -> None:
    if shutil.which("gltf-anim") is None:
        command = command.replace("gltf-anim ", f"'{sys.executable}' -m cli.main ")
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command], cwd=folder, capture_output=True, text=True, env=_environment()
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("example", PYTHON)
def test_example_runs(example: str, folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", example], cwd=folder, capture_output=True, text=True, env=_environment()
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("kind", ["csv", "json"])
def test_curve_examples_are_read(kind: str, folder: Path) -> None:
    (content,) = re.findall(rf"```{kind}\n(.*?)```", TEXT, re.DOTALL)
    (folder / f"curves.{kind}").write_text(content)
    command = [sys.executable, "-m", "cli.main", "from-euler", f"curves.{kind}", "curves.glb"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=_environment())
    assert done.returncode == 0, done.stderr


def test_commands_are_found() -> None:
    assert len(COMMANDS) >= 10
    assert PYTHON


def test_no_merge_is_left_half_done() -> None:
    assert [line for line in TEXT.splitlines() if re.match(r"<{7}|={7}|>{7}", line)] == []


def _environment() -> dict[str, str]:
    import os

    return {**os.environ, "PYTHONPATH": str(ROOT), "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
