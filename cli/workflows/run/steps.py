"""Steps of recipes: command lines without files, parsed by the commands themselves."""

from __future__ import annotations

import difflib
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import typer
from typer import TyperException

from cli import main
from cli.command_table import COMMANDS
from cli.errors import UsageError, usage_problem
from cli.io.documents import PIPE
from cli.streams import StepStreams, use_streams
from cli.typer_options import DEPFILE

EDITING = ("resample", "ease", "spline", "retime", "trim", "loop", "simulate", "optimize", "convert")  # glTF to glTF
MAKING = ("from-euler",)  # glTF from another format: first steps only
REFUSED = {  # options that no step can have, by parameter
    "dry_run": "writes nothing",
    "report": "writes a file for every file",
    "depfile": "is about one file",
    "out": "names files",
    "curve_file": "writes no glTF",
    "find": "writes no glTF",
    "list_eases": "writes no glTF",
    "list_rules": "writes no glTF",
}


@dataclass(frozen=True)
class Step:
    """A parsed step. command: its words, ("simulate", "springs") of a kind of simulation. options: all other words.

    files: names of files in its options, which it reads. onto: that of them which is the glTF that it changes, instead
    of its input; "" without one.
    """

    command: tuple[str, ...]
    options: tuple[str, ...]
    files: tuple[str, ...] = ()
    onto: str = ""

    def words(self, input: str = PIPE, output: str = PIPE) -> list[str]:
        """Return the command line on these files."""
        return [*self.command, input, output, *self.options]

    @property
    def label(self) -> str:
        """The command, for messages."""
        return " ".join(self.command)

    @property
    def line(self) -> str:
        """The step as a recipe has it."""
        return shlex.join((*self.command, *self.options))


def parse_step(line: str, *, is_first: bool) -> Step:
    """Return the step of a command line without files. Raises UsageError.

    The command's own parser checks the options; nothing runs.
    """
    try:
        words = shlex.split(line)
    except ValueError as error:  # an open quote
        raise UsageError(f"'{line}' can't be split into words ({str(error).lower()})") from None
    if words[:1] == [main.PROGRAM]:
        words = words[1:]
    group: Any = typer.main.get_command(main.app)
    _check_command(words, is_first=is_first)
    context = group.make_context(main.PROGRAM, words[:1])
    number = 1
    command = group.get_command(context, words[0])
    if hasattr(command, "table"):  # of kinds
        _check_kind(words, command)
        context, number = command.make_context(words[0], words[1:2], parent=context), 2
        command = command.get_command(context, words[1])
    step = Step(tuple(words[:number]), tuple(words[number:]))
    found = _parsed(command, step, context)
    _check_values(command, step, found)
    files = (found[each.name] for each in command.params if each.param_type_name == "option" and each.metavar == "FILE")
    return Step(step.command, step.options, tuple(filter(None, files)), found.get("onto") or "")


def _check_command(words: list[str], *, is_first: bool) -> None:
    allowed = (*EDITING, *(MAKING if is_first else ()))
    if words and words[0] in allowed:
        return
    name = words[0] if words else ""
    expected = f"a step is one of {', '.join(allowed)}"
    if name in MAKING:
        raise UsageError(f"'{name}' reads no glTF: it can only be the first step")
    if name in COMMANDS:
        raise UsageError(f"'{name}' makes no glTF from glTF", help=expected)
    near = difflib.get_close_matches(name, allowed, n=1)
    raise UsageError(f"there is no command '{name}'", help=f"did you mean '{near[0]}'?" if near else expected)


def _check_kind(words: list[str], group: Any) -> None:
    kind = words[1] if len(words) > 1 else ""
    if kind in group.table:
        return
    near = difflib.get_close_matches(kind, group.table, n=1)
    hint = f"did you mean '{near[0]}'?" if near else f"the kinds are {', '.join(group.table)}"
    raise UsageError(f"{words[0]}: no such kind '{kind}'", help=hint)


def _parsed(command: Any, step: Step, context: Any) -> dict[str, Any]:
    """Values of the command's parameters, without those of files that the step does not name."""
    name = step.command[-1]
    try:
        with use_streams(StepStreams("", np.empty(0, np.uint8), Path())):  # for the text of --help
            parsed = command.make_context(name, list(step.options), parent=context)
    except typer.Exit:  # --help
        raise UsageError(f"{step.label}: --help makes no glTF") from None
    except TyperException as error:
        problem, hint = usage_problem(error)
        raise UsageError(problem, help=hint) from None
    arguments = {each.name for each in command.params if each.param_type_name == "argument"}
    given = {
        name: value
        for name, value in parsed.params.items()
        if name not in arguments or parsed.get_parameter_source(name).name == "COMMANDLINE"
    }
    return {**given, "depfile": parsed.meta.get(DEPFILE)}


def _check_values(command: Any, step: Step, values: dict[str, Any]) -> None:
    """Raise UsageError for names of files, and for options that no step can have."""
    for each in command.params:
        if each.param_type_name == "argument" and values.get(each.name):
            file = values[each.name]
            name = file if isinstance(file, str) else file[0]
            problem = f"{step.label}: '{name}' is a file (expected options: the recipe has the files)"
            raise UsageError(problem)
        if each.name in REFUSED and values.get(each.name) not in (None, False):
            raise UsageError(f"{step.label}: {max(each.opts, key=len)} {REFUSED[each.name]}: leave it out of a step")
