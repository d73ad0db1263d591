"""What a run imports: little to show help, and nothing heavy that a command doesn't need."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from cli import main
from tests.cli.running import ENVIRONMENT, ROOT, built

# Runs one command line and says on stderr which modules it left behind.
SCRIPT = """
import json, os, sys
from cli import main
code = main.run(json.loads(sys.argv[1]))
sys.stdout.flush()
print(json.dumps([code, sorted(sys.modules)]), file=sys.stderr)
"""
NEVER = {
    "rich",
    "trimesh",
    "pygltflib",
    "numba",
    "matplotlib",
    "PIL",
    "png",
    "mujoco",
    "pxr",
    "dask",
}
HEAVY = NEVER | {"scipy", "meshopt"}
STARTING = {"asyncio", "http", "multiprocessing", "unittest", "urllib.request", "xml"}


def modules(*line: str | Path, stdin: bytes = b"") -> set[str]:
    """The modules that one command line imports, in a process of its own."""
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT, json.dumps([str(arg) for arg in line])],
        cwd=ROOT,
        env=ENVIRONMENT,
        input=stdin,
        capture_output=True,
        check=True,
    )
    code, names = json.loads(run.stderr.splitlines()[-1])
    assert code == 0, run.stderr
    return set(names)


def tops(names: set[str]) -> set[str]:
    return {name.split(".")[0] for name in names}


@pytest.mark.parametrize("line", [["--help"], ["--version"], []])
def test_help_imports_no_command_and_no_numbers(line: list[str]) -> None:
    names = modules(*line)
    assert not tops(names) & (HEAVY | {"numpy"})
    assert not names & STARTING
    assert not {name for name in names if name.startswith("cli.commands.")}


@pytest.mark.parametrize("command", main.COMMANDS)
def test_the_help_of_a_command_imports_that_command_only(command: str) -> None:
    names = modules(command, "--help")
    assert not tops(names) & HEAVY
    own = f"cli.commands.{command.replace('-', '_')}"
    assert {name for name in names if name.startswith("cli.commands.")} == {own}


@pytest.mark.parametrize(
    "line",
    [
        ["inspect", "--tracks"],
        ["inspect", "--format", "json"],
        ["sample", "--at", "0", "--space", "world", "--format", "csv"],
        ["resample", "--fps", "12"],
        ["resample", "--fps", "12", "--interpolation", "cubicspline", "--clip", "walk"],
        ["convert", "-", "-"],
    ],
)
def test_a_run_imports_nothing_heavy(line: list[str]) -> None:
    assert not tops(modules(*line, stdin=built("biped"))) & HEAVY


def test_inspect_imports_no_more_of_numpy_and_of_us_than_it_shows() -> None:
    names = modules("inspect", stdin=built("biped"))
    assert not names & {"numpy.ma", "anim.measure.continuity.continuity", "cli.reports.continuity_report"}
    assert "anim.measure.continuity.continuity" in modules("inspect", "--continuity", stdin=built("biped"))


def test_a_wrong_command_line_imports_nothing_heavy_either() -> None:
    script = SCRIPT.replace("code = main", "code = 0 * main")
    for line in (["resampel"], ["resample", "--fps", "x"]):
        run = subprocess.run(
            [sys.executable, "-c", script, json.dumps(line)], cwd=ROOT, env=ENVIRONMENT, capture_output=True, check=True
        )
        assert not tops(set(json.loads(run.stderr.splitlines()[-1])[1])) & HEAVY


def completed(words: str, shell: str = "bash") -> tuple[str, set[str]]:
    """What a shell is told that completes the last of these words, and the modules that took."""
    environment = {
        **ENVIRONMENT,
        "_GLTF_ANIM_COMPLETE": f"complete_{shell}",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split(" ")) - 1),
        "_TYPER_COMPLETE_ARGS": words,
    }
    script = (
        "import sys, atexit; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); sys.argv = ['gltf-anim']; "
    )
    script += "from cli import main; main.run([])"
    run = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    (modules,) = run.stderr.splitlines()  # and no word to the person who types
    return run.stdout, set(modules.split())


@pytest.mark.parametrize(
    ("words", "found"),
    [("gltf-anim re", {"resample", "retime", "render"}), ("gltf-anim ", set(main.COMMANDS)), ("gltf-anim zzz", set())],
)
def test_completion_of_a_command_imports_none(words: str, found: set[str]) -> None:
    shown, names = completed(words)
    assert set(shown.split()) == found
    assert not tops(names) & (HEAVY | {"numpy"})
    assert not {name for name in names if name.startswith("cli.commands.")}


def test_a_shell_that_shows_words_beside_names_gets_those_of_the_table() -> None:
    shown, names = completed("gltf-anim ren", "zsh")
    assert main.COMMANDS["render"].about in shown
    assert "cli.commands.render" not in names


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("gltf-anim --ver", {"--version"}),
        ("gltf-anim resample --f", {"--fps"}),
        ("gltf-anim resample --interpolation c", {"cubicspline"}),
    ],
)
def test_options_and_their_choices_are_completed(words: str, found: set[str]) -> None:
    assert set(completed(words)[0].split()) == found


def test_completion_behind_a_command_that_is_none_says_nothing_of_it() -> None:
    assert "resample" in completed("gltf-anim zzz re")[0]
