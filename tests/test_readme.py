"""Every command and the Python example in the README run as they stand there."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

import pytest

from docs import pages
from tests.pages import missing as pages_missing

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = [command for block in re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL) for command in pages.commands(block)]
PYTHON = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for all commands: some read what an earlier one wrote, as a reader would."""
    folder = tmp_path_factory.mktemp("readme")
    pages.write_inputs(folder)
    return folder


@pytest.mark.parametrize("command", COMMANDS)
def test_command_runs(command: str, folder: Path) -> None:
    if command.startswith("gltf-anim view") and pages_missing():
        pytest.skip(pages_missing())
    code, text = pages.run_here(command, folder)
    assert code == 0, text


@pytest.mark.parametrize("example", PYTHON)
def test_example_runs(example: str, folder: Path) -> None:
    done = pages.run(shlex.join([sys.executable, "-c", example]), folder)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("kind", ["csv", "json"])
def test_curve_examples_are_read(kind: str, folder: Path) -> None:
    (content,) = re.findall(rf"```{kind}\n(.*?)```", TEXT, re.DOTALL)
    (folder / f"curves.{kind}").write_text(content)
    code, text = pages.run_here(f"gltf-anim from-euler curves.{kind} curves.glb", folder)
    assert code == 0, text


def test_commands_are_found() -> None:
    assert len(COMMANDS) >= 10
    assert PYTHON


def test_no_merge_is_left_half_done() -> None:
    assert [line for line in TEXT.splitlines() if re.match(r"<{7}|={7}|>{7}", line)] == []
