"""SARIF of `check` by Microsoft's validator, with its rules of GitHub; npm has it as @microsoft/sarif-multitool."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built

PROGRAM = os.environ.get("SARIF_MULTITOOL")


@pytest.mark.slow
@pytest.mark.skipif(PROGRAM is None, reason="$SARIF_MULTITOOL does not name Sarif.Multitool")
def test_sarif_passes_the_rules_of_github(folder: Path, call: Call) -> None:
    (folder / "no gltf, 100%.glb").write_bytes(b"no glTF")
    (folder / "crowd" / "ä b#1.glb").write_bytes(built("noop"))
    (folder / "all.sarif").write_bytes(call("check", ".", "--select", "ALL", "--format", "sarif").out)
    (folder / "none.sarif").write_bytes(call("check", "noop.glb", "--select", "GA001", "--format", "sarif").out)
    for name in ("all", "none"):
        words = [str(PROGRAM), "validate", f"{name}.sarif", "--output", f"{name}-judged.sarif"]
        words += ["--rule-kind", "Sarif;Ghas", "--level", "Error;Warning"]
        environment = {**os.environ, "DOTNET_SYSTEM_GLOBALIZATION_INVARIANT": "1"}
        subprocess.run(words, cwd=folder, env=environment, check=True, capture_output=True)
        (run,) = json.loads((folder / f"{name}-judged.sarif").read_text("utf-8-sig"))["runs"]
        assert [(each["ruleId"], each["message"]) for each in run["results"]] == []
