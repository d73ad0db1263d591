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
BLOCKS = [pages.commands(block) for block in re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL)]
SLOW_BLOCKS = ("gltf-anim run", "gltf-anim optimize biped.glb exact.glb --max-error 0")  # a command of each
PYTHON = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


def is_slow(block: list[str]) -> bool:
    return any(command in SLOW_BLOCKS for command in block)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for all commands: some read what an earlier one wrote, as a reader would."""
    folder = tmp_path_factory.mktemp("readme")
    pages.write_inputs(folder)
    return folder


@pytest.mark.parametrize("command", [command for block in BLOCKS if not is_slow(block) for command in block])
def test_command_runs(command: str, folder: Path) -> None:
    if command.startswith("gltf-anim view") and pages_missing():
        pytest.skip(pages_missing())
    code, text = pages.run_here(command, folder)
    assert code == 0, text


@pytest.mark.slow
@pytest.mark.parametrize("block", [block for block in BLOCKS if is_slow(block)])
def test_slow_commands_run(block: list[str], tmp_path: Path) -> None:
    """A block that needs no file that others write."""
    pages.write_inputs(tmp_path)
    for command in block:
        code, text = pages.run_here(command, tmp_path)
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
    assert sum(map(len, BLOCKS)) >= 10
    assert all(sum(slow in block for block in BLOCKS) == 1 for slow in SLOW_BLOCKS)
    assert PYTHON


def test_no_merge_is_left_half_done() -> None:
    assert [line for line in TEXT.splitlines() if re.match(r"<{7}|={7}|>{7}", line)] == []
