"""The action's script runs under `bash -e`, and hooks name commands that exist."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from cli.main import COMMANDS
from docs.pages import run
from tests.cli.running import ROOT, built


def script_of_action() -> str:
    text = (ROOT / "action.yml").read_text(encoding="utf-8")
    found = re.search(r"- name: Check\n.*?run: \|\n(.*?)    - name:", text, re.DOTALL)
    assert found
    return textwrap.dedent(found.group(1))


@pytest.mark.skipif(sys.platform == "win32", reason="bash and pip's scripts differ there")
@pytest.mark.parametrize(("fail_on", "code"), [("error", 0), ("info", 6)])
def test_the_action_annotates_sums_up_and_fails(fail_on: str, code: int, tmp_path: Path) -> None:
    (tmp_path / "noop.glb").write_bytes(built("noop"))
    variables = f"export FILES=. OPTIONS= FAIL_ON={fail_on} GITHUB_STEP_SUMMARY=summary.md; set -e\n"
    done = run(variables + script_of_action(), tmp_path)
    assert done.returncode == code, done.stdout
    assert "::warning file=noop.glb,title=GA101 wide-steps::" in done.stdout
    assert "| noop.glb | warning | GA101 wide-steps |" in (tmp_path / "summary.md").read_text("utf-8")
    assert json.loads((tmp_path / "gltf-anim.sarif").read_text("utf-8"))["version"] == "2.1.0"


def test_hooks_call_commands_of_the_table() -> None:
    text = (ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")
    entries = [shlex.split(line) for line in re.findall(r"entry: (.*)", text)]
    assert entries
    for program, command, *_ in entries:
        assert program == "gltf-anim"
        assert command in COMMANDS


def test_the_script_is_sound_bash() -> None:
    assert subprocess.run(["bash", "-n"], input=script_of_action().encode(), check=False).returncode == 0
