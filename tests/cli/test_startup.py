"""Modules that command lines import: few for help and completion, no heavy package that a command does not use."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from anim.simulation.registry import SIMULATIONS
from cli.command_table import COMMANDS
from tests.cli.running import ENVIRONMENT, ROOT, built

# Runs command lines in one process, and writes its exit codes and the modules loaded so far to stderr.
RUN = """
import json, sys
from cli import main
found = []
for line in json.loads(sys.argv[1]):
    found.append([main.run(line), sorted(sys.modules)])
sys.stdout.flush()
print(json.dumps(found), file=sys.stderr)
"""
# Completes the last of some words, as a shell asks for it.
COMPLETE = """
import contextlib, io, json, os, sys
from cli import main
sys.argv = ["gltf-anim"]
found = []
for words, shell in json.loads(os.environ["CASES"]):
    os.environ["_GLTF_ANIM_COMPLETE"] = f"complete_{shell}"
    os.environ["COMP_WORDS"] = os.environ["_TYPER_COMPLETE_ARGS"] = words
    os.environ["COMP_CWORD"] = str(len(words.split(" ")) - 1)
    with contextlib.redirect_stdout(io.StringIO()) as shown, contextlib.suppress(SystemExit):
        main.run([])
    found.append([shown.getvalue(), sorted(sys.modules)])
print(json.dumps(found))
"""
NEVER = {"rich", "trimesh", "pygltflib", "numba", "matplotlib", "PIL", "png", "mujoco", "pxr", "dask"}
HEAVY = NEVER | {"scipy", "meshopt"}
FIXING = {"anim.check.fixing", "anim.optimization", "anim.operations.cubic_segments", "anim.gltf.meshopt"}
WRITING = {"anim.gltf.writing.append", "anim.gltf.writing.buffers", "anim.gltf.writing.writer", "anim.files.atomic"}
MEASURING = {"anim.measure.continuous_bound", "anim.measure.compare"}
SHOWING = {"anim.show", "anim.exchange.formats", "anim.exchange.euler"}
UNUSED = {  # by command line: modules of other options
    "inspect biped.glb": FIXING | WRITING | MEASURING | SHOWING | {"anim.measure.loops.loop_analysis", "glob"},
    "check biped.glb --select ALL": FIXING | WRITING | MEASURING | SHOWING,
    "diff biped.glb biped.glb": WRITING | SHOWING | {"anim.caches.transforms", "anim.check"},
    "resample biped.glb out.glb --fps 12": SHOWING | {"anim.check", "anim.caches"},
    "bake biped.glb out.npz --clip walk": SHOWING | {"anim.check", "anim.measure.continuous_bound"},
}
STARTING = {"asyncio", "http", "multiprocessing", "unittest", "urllib.request", "xml"}


def test_the_first_help_imports_no_command_and_no_numbers() -> None:
    for _, names in _run(["--help"], ["--version"], []):
        assert not _packages(names) & (HEAVY | {"numpy"})
        assert not names & STARTING
        assert not _commands(names)


def test_the_help_of_a_command_imports_that_command_only() -> None:
    results = _run(*([command, "--help"] for command in COMMANDS))
    before: set[str] = set()
    for command, (code, names) in zip(COMMANDS, results, strict=True):
        assert code == 0
        assert not _packages(names) & HEAVY, command
        assert _commands(names) - before == {f"cli.commands.{command.replace('-', '_')}"}
        before = _commands(names)


def test_the_help_of_a_kind_of_simulation_imports_no_heavy_package() -> None:
    for kind in SIMULATIONS:
        ((code, names),) = _run(["simulate", kind, "--help"])
        assert code == 0
        assert not _packages(names) & HEAVY, kind


def test_a_run_imports_only_packages_that_it_uses(tmp_path: Path) -> None:
    path = tmp_path / "biped.glb"
    path.write_bytes(built("biped"))
    lines = [
        ["inspect", str(path)],
        ["inspect", str(path), "--tracks"],
        ["inspect", str(path), "--format", "json"],
        ["sample", str(path), "--at", "0", "--space", "world", "--format", "csv"],
        ["resample", str(path), "--fps", "12"],
        ["resample", str(path), "--fps", "12", "--interpolation", "cubicspline", "--clip", "walk"],
        ["convert", str(path), "-"],
        ["inspect", str(path), "--continuity"],
        ["resampel"],
        ["resample", "--fps", "x"],
    ]
    results = _run(*lines)
    assert [code for code, _ in results] == [0] * 8 + [2] * 2
    continuity = {"anim.measure.continuity.continuity", "cli.reports.continuity_report"}
    masked = set() if np.__version__.startswith("1.") else {"numpy.ma"}  # numpy 1 imports it with itself
    assert not results[0][1] & (continuity | masked)
    assert results[7][1] >= continuity
    assert not _packages(results[-1][1]) & HEAVY


@pytest.mark.parametrize("line", UNUSED)
def test_a_plain_run_does_not_import_what_only_its_options_use(line: str, tmp_path: Path) -> None:
    (tmp_path / "biped.glb").write_bytes(built("biped"))
    words = [str(tmp_path / word) if "." in word else word for word in line.split()]
    ((code, names),) = _run(words)
    assert code == 0
    assert not {name for name in names for prefix in UNUSED[line] if f"{name}.".startswith(f"{prefix}.")}


def test_completion_of_commands_imports_none() -> None:
    cases = {"gltf-anim re": {"resample", "retime", "render"}, "gltf-anim ": set(COMMANDS), "gltf-anim zzz": set()}
    *results, (described, _) = _complete(*((words, "bash") for words in cases), ("gltf-anim ren", "zsh"))
    for (shown, names), expected in zip(results, cases.values(), strict=True):
        assert set(shown.split()) == expected
        assert not _packages(names) & (HEAVY | {"numpy"})
        assert not _commands(names)
    assert COMMANDS["render"].about in described  # some shells show words beside names


def test_options_and_their_choices_are_completed() -> None:
    cases = {
        "gltf-anim --ver": {"--version"},
        "gltf-anim resample --f": {"--fps"},
        "gltf-anim resample --interpolation c": {"cubicspline"},
    }
    *results, (unknown, _) = _complete(*((words, "bash") for words in cases), ("gltf-anim zzz re", "bash"))
    for (shown, _), expected in zip(results, cases.values(), strict=True):
        assert set(shown.split()) == expected
    assert "resample" in unknown  # a command that does not exist stops nothing


def _run(*lines: list[str]) -> list[tuple[int, set[str]]]:
    """Exit codes of command lines that run one after the other in a new process, and the modules loaded by then."""
    run = subprocess.run(
        [sys.executable, "-c", RUN, json.dumps(lines)], cwd=ROOT, env=ENVIRONMENT, capture_output=True, check=True
    )
    return [(code, set(names)) for code, names in json.loads(run.stderr.splitlines()[-1])]


def _complete(*cases: tuple[str, str]) -> list[tuple[str, set[str]]]:
    """Output for words and shells, in a new process that writes nothing to stderr, and the modules loaded by then."""
    environment = {**ENVIRONMENT, "CASES": json.dumps(cases)}
    run = subprocess.run(
        [sys.executable, "-c", COMPLETE], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )
    assert not run.stderr
    return [(shown, set(names)) for shown, names in json.loads(run.stdout)]


def _packages(names: set[str]) -> set[str]:
    return {name.split(".")[0] for name in names}


def _commands(names: set[str]) -> set[str]:
    return {name for name in names if name.startswith("cli.commands.")}
