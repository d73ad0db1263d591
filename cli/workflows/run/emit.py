"""Scripts of single commands that make what a run makes: for a shell, ninja, or make."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import PurePosixPath
from typing import TypeAlias

from anim.errors import AnimError
from anim.gltf.document import json_array
from anim.gltf.io.images import external_uri
from anim.gltf.io.source import buffer_files, open_file
from cli.errors import DONE, PROGRAM, UsageError, run_guarded
from cli.io import output_names
from cli.workflows.run.job import Job, argument_of, document_file
from cli.workflows.run.places import output_key
from cli.workflows.run.steps import Step

HEADER = f"# made by `{PROGRAM} run --emit`"
IN_BASH = '[ -n "${BASH_VERSION-}" ] || exec bash "$0"  # for bash: `sh` has no pipefail everywhere'
EMBED = "--embed"
ADVICE_TO_EMBED = f'take images in: steps = ["convert {EMBED}", …]'
NOT_IN_MAKE = "\t\n\v\f\r%;=*?[]~\\|&"  # in a rule they mean something, and an escape does not hold everywhere
NOT_IN_NINJA = "\n\r|"  # it has no escape for them
Escape: TypeAlias = Callable[[str], str]  # of a text in a rule


def shell_script(jobs: Sequence[Job]) -> str:
    """Return a script for bash, a line a file."""
    lines = ["#!/usr/bin/env bash", HEADER, IN_BASH, "set -euo pipefail", f"cd {shlex.quote(str(jobs[0].folder))}"]
    folders = sorted({PurePosixPath(job.output).parent.as_posix() for job in jobs})
    lines.append(f"mkdir -p -- {shlex.join(folders)}")
    for job in jobs:
        _check_images(job)
        lines.append(_pipeline(job.steps, shlex.quote(argument_of(job.input)), shlex.quote(argument_of(job.output))))
    return "\n".join(lines) + "\n"


def makefile(jobs: Sequence[Job]) -> str:
    """Return rules for make, to be used in the folder of the settings."""
    rules, names, outputs = [], [], _outputs(jobs)
    for job in jobs:
        _check_images(job)
        output, *inputs = (_in_make(name) for name in (job.output, job.input, *_other_inputs(job, outputs)))
        rules.append(f"{output}: {' '.join(inputs)}\n\t" + "\n\t".join(_make_commands(job)) + "\n")
        names.append(output)
    head = [HEADER, ".DELETE_ON_ERROR:", ".PHONY: all", f"all: {' '.join(names)}\n"]
    return "\n".join(head + rules)


def ninja_file(jobs: Sequence[Job]) -> str:
    """Return rules and builds for ninja, to be used in the folder of the settings."""
    rules: dict[tuple[tuple[Step, ...], str, str], str] = {}
    builds, outputs = [], _outputs(jobs)
    for job in jobs:
        _check_images(job)
        key = (job.steps, _variable_in_ninja("$in", job.input), _variable_in_ninja("$out", job.output))
        name = rules.setdefault(key, f"recipe{len(rules) + 1}")
        output, *inputs = (_in_ninja(each) for each in (job.output, job.input, *_other_inputs(job, outputs)))
        implicit = f" | {' '.join(inputs[1:])}" if inputs[1:] else ""
        builds.append(f"build {output}: {name} {inputs[0]}{implicit}\n")
    texts = []
    for (steps, input, output), name in rules.items():
        command = _pipeline(steps, input, output, escape=_one_line)
        texts.append(f"rule {name}\n  command = {command}\n  description = $out\n")
    return "\n".join([HEADER, *texts, *builds])


def readable_jobs(jobs: Sequence[Job]) -> tuple[list[Job], int]:
    """Return the jobs with readable inputs, and the largest exit code of the others, whose errors are reported."""
    codes = [run_guarded(partial(_open_input, job)) for job in jobs]
    return [job for job, code in zip(jobs, codes, strict=True) if code == DONE], max(codes, default=DONE)


def _open_input(job: Job) -> None:
    """Open the glTF that a job begins with. Raises AnimError with its name, and UsageError for a reserved name."""
    output_names.check_placeholders(job.output)
    first = job.steps[0]
    file = document_file(job)
    if file is not None and (not first.onto or file.exists()):  # else an output that is made first
        try:
            open_file(str(file))
        except AnimError as error:
            raise error.at(first.onto or job.input, ": ") from None


def _pipeline(steps: Sequence[Step], input: str, output: str, escape: Escape = str) -> str:
    """The steps as commands with pipes between them. input, output: as the script has them."""
    last = len(steps) - 1
    lines = [
        " ".join(
            [
                PROGRAM,
                escape(shlex.join(step.command)),
                input if i == 0 else "-",
                output if i == last else "-",
                *([escape(shlex.join(step.options))] if step.options else []),
            ]
        )
        for i, step in enumerate(steps)
    ]
    return " | ".join(lines)


def _outputs(jobs: Sequence[Job]) -> dict[str, str]:
    """Outputs by their keys: a step may read one by another spelling, which make would take for another file."""
    return {output_key(job.output): job.output for job in jobs}


def _other_inputs(job: Job, outputs: Mapping[str, str]) -> Iterator[str]:
    """Yield the other files that a job reads: of its steps' options, and buffers of the input."""
    for step in job.steps:
        yield from (outputs.get(output_key(name), name) for name in step.files)
    if (file := document_file(job)) is not None and file.exists():  # else an output that is made first
        for path in buffer_files(open_file(str(file))):
            yield os.path.relpath(path, os.path.realpath(job.folder))


def _check_images(job: Job) -> None:
    """Raise UsageError for an input with external images, which no pipe carries."""
    file, first = document_file(job), job.steps[0]
    if file is None or not file.exists() or EMBED in first.options or len(job.steps) == 1:
        return
    document = open_file(str(file)).document
    outside = [external_uri(image) for image in json_array(document.json, "images") if external_uri(image)]
    if outside:
        raise UsageError(
            f"{first.onto or job.input}: its image '{outside[0]}' is another file, which a pipe does not copy",
            help="`gltf-anim run` copies it; for a script, "
            + (f"name a file with its images in it: `convert {EMBED}`" if first.onto else ADVICE_TO_EMBED),
        )


def _make_commands(job: Job) -> list[str]:
    """Lines of a rule, with automatic variables if the names need no escapes."""
    if any(re.search("^-|[ '#:]", name) for name in (job.input, job.output)):
        folder = shlex.quote(PurePosixPath(job.output).parent.as_posix())
        command = _pipeline(job.steps, shlex.quote(argument_of(job.input)), shlex.quote(argument_of(job.output)))
        return [_one_line(each) for each in (f"@mkdir -p -- {folder}", command)]
    return ["@mkdir -p '$(@D)'", _pipeline(job.steps, "'$<'", "'$@'", escape=_one_line)]


def _one_line(command: str) -> str:
    """A command, or words of one, as text of a rule. Raises UsageError for a line break, which would end the rule."""
    if re.search(r"[\n\r]", command):
        raise UsageError(f"a step has a line break, which make and ninja can't have: {command}", help="--emit shell")
    return command.replace("$", "$$")


def _in_make(name: str) -> str:
    """A name as a target or prerequisite."""
    _check_name(name, NOT_IN_MAKE, "make")
    return re.sub(r"([ #:])", r"\\\1", name).replace("$", "$$")


def _in_ninja(name: str) -> str:
    """A name as an output or input of a build."""
    _check_name(name, NOT_IN_NINJA, "ninja")
    return name.replace("$", "$$").replace(" ", "$ ").replace(":", "$:")


def _variable_in_ninja(variable: str, name: str) -> str:
    """The variable for a name in a command: ninja takes "./" from a name, without which "-x.glb" is an option."""
    return f"./{variable}" if name.startswith("-") else variable


def _check_name(name: str, refused: str, tool: str) -> None:
    found = next((c for c in name if c in refused), "")
    if found:
        help = "--emit shell" if tool == "ninja" or any(c in NOT_IN_NINJA for c in name) else "--emit ninja or shell"
        raise UsageError(f"'{name}': {tool} has no names with {found!r}", help=help)


SCRIPTS: Mapping[str, Callable[[Sequence[Job]], str]] = {"shell": shell_script, "ninja": ninja_file, "make": makefile}
