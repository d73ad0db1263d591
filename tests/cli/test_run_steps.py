"""`run`: what can be a step of a recipe; the others are refused before anything runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import typer

from cli import main
from cli.command_table import COMMANDS
from cli.workflows.run.steps import EDITING, MAKING, REFUSED
from tests.cli.conftest import Call
from tests.cli.running import help_line, refusal
from tests.cli.running_recipes import write_recipe


@pytest.mark.parametrize(
    ("steps", "problem", "hint"),
    [
        (["resampel --fps 30"], "recipe 1: step 1: there is no command 'resampel'", "did you mean 'resample'?"),
        (["convert", "resample --fsp 30"], "step 2: resample: no such option: --fsp", "did you mean '--fps'"),
        (["check"], "'check' makes no glTF from glTF", "a step is one of resample"),
        (["convert", "from-euler"], "'from-euler' reads no glTF: it can only be the first step", ""),
        (["simulate spring"], "no such kind 'spring'", "did you mean 'springs'?"),
        (["resample a.glb --fps 3"], "'a.glb' is a file", ""),
        (["optimize -"], "optimize: '-' is a file", ""),
        (["resample --fps 3 - -"], "resample: '-' is a file", ""),
        (["trim --clip 'a\0b' --to 1"], "step 1 has a null character", ""),
        (["resample --fps x"], "invalid value for '--fps': 'x' is no number", "resample --help"),
        (["resample"], "missing option '--fps'", ""),
        (["resample --fps 3", "optimize --max-error '5 parsecs'"], "step 2: --max-error is '5 parsecs' (expected", ""),
        (["optimize --max-bytes 3lb"], "step 1: --max-bytes is '3lb' (expected a size like", ""),
        (["ease --tolerance 1mm"], "step 1: --tolerance is '1mm' (expected a share", ""),
        (["simulate springs --max-error 1deg"], "step 1: --max-error is '1deg' (expected a length", ""),
        (["simulate particles --node '*' --spread 5"], "step 1: --spread is '5' (expected an angle", ""),
        (["optimize --report a.json"], "--report writes a file for every file", ""),
        (["resample --fps 3 --depfile a.d"], "--depfile is about one file", ""),
        (["ease --help"], "--help makes no glTF", ""),
        (["ease 'x"], "can't be split into words", ""),
    ],
)
def test_unknown_steps_are_refused_before_anything_runs(
    steps: list[str], problem: str, hint: str, folder: Path, call: Call
) -> None:
    write_recipe(folder, *steps)
    run = call("run")
    assert problem in refusal(run, 2)
    assert help_line(run).startswith(hint) or hint in help_line(run)
    assert not (folder / "build").exists()


def test_broken_recipes_are_refused(folder: Path, call: Call) -> None:
    path = folder / "gltf-anim.toml"
    assert "has no gltf-anim.toml" in refusal(call("run"), 2) or "there is no gltf-anim.toml" in call("run").err
    for text, problem in {
        "[check]\n": "has no [[recipe]]",
        "[[recipe]]\nsteps = ['convert']\nout = 'x/{path}'\n": "recipe 1: has no match",
        "[[recipe]]\nstep = []\n": "unknown key 'recipe.step'",
        '[[recipe]]\nmatch="*"\nsteps = ["convert"]\nout = "a\\u0000{path}"\n': "recipe 1: out has a null character",
        '[[recipe]]\nmatch="a\\u0000/*"\nsteps = ["convert"]\nout = "x/{path}"\n': "match has a null character",
        "[[recipe]]\nmatch='../*'\nsteps = ['convert']\nout = 'x/{path}'\n": "expected a path below the folder",
        "[[recipe]]\nmatch='*.glb'\nsteps = ['convert']\nout = 'x/{clip}'\n": "{clip} stands for nothing",
        "[[recipe]]\nmatch='*.glb'\nsteps = ['convert']\nout = '{path}'\n": "'noop.glb' is its own output",
        "[[recipe]]\nmatch='**/*.glb'\nsteps = ['convert']\nout = 'a.glb'\n": "have the same output, 'a.glb'",
        "[[recipe]]\nmatch='*.glb'\nsteps = ['convert']\nout = 'a.obj'\n": "glTF is no '.obj'",
        "[[recipe]]\nmatch='*.glb'\nsteps = [3]\nout = 'a.glb'\n": "step 1 is no text",
    }.items():
        path.write_text(text)
        assert problem in refusal(call("run"), 2)
    path.write_text("[[recipe]]\nmatch='*.glb'\nsteps = ['convert']\nout = 'b/{path}'\n")
    assert "crowd/arm 1.glb: matches no recipe" in refusal(call("run", "crowd"), 2)
    assert "there is no recipe 'x'" in refusal(call("run", "--recipe", "x"), 2)


def test_commands_that_make_gltf_from_gltf_are_steps() -> None:
    group: Any = typer.main.get_command(main.app)
    making = {name for name in COMMANDS if _makes_gltf(group.get_command(None, name))}
    missing = making ^ {*EDITING, *MAKING}
    assert not missing, f"EDITING of cli/workflows/run/steps.py names what makes glTF from glTF: {missing}"


def test_options_of_steps_that_name_files_are_read_or_refused() -> None:
    group: Any = typer.main.get_command(main.app)
    commands = [group.get_command(None, name) for name in (*EDITING, *MAKING)]
    kinds = [each.get_command(None, kind) for each in commands for kind in getattr(each, "table", ())]
    named = {each.name for command in (*commands, *kinds) for each in command.params if each.metavar == "FILE"}
    assert named - REFUSED.keys() == {"onto", "alias", "springs"}, "others are written, or a new one is read"


def _makes_gltf(command: Any) -> bool:
    if hasattr(command, "table"):
        return any(_makes_gltf(command.get_command(None, kind)) for kind in command.table)
    arguments = [each for each in command.params if each.param_type_name == "argument"]
    return len(arguments) > 1 and (arguments[1].help or "").startswith(("A .glb or .gltf file", "A .glb, .gltf, .usdz"))
