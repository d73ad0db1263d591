"""Absurd values of every option that takes one and names no file, on sound files, for what mutations of files miss."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from random import Random
from typing import Any

import typer

import fixtures
from cli import main
from tests.fuzz.execution import Job
from tests.fuzz.families import command_words, seeds
from tests.fuzz.seed import Seed

VALUES = (
    "1e308", "-1e308", "nan", "inf", "-1", "0", "1e-320", "1e18", "9" * 25, "", "x" * 3000, "1e308deg", "1e308m",
    "1e308%", "1e-300m", "0:1e308", "1e308,1e308,1e308", "#99999999999", "*", "1/0", "1e308/1e-308", "linear", "XYZ",
    "\udcff",
)  # fmt: skip
FILES = re.compile(r"\b(FILE|OUT|DIR|ADDRESS)\b")  # in metavars; an address is waited for
OUTPUT = "--out"
SEEDS = {"gltf": (0,), "euler": (0, 1, 2), "cache": (0, 1), "springs": (0, 2), "bodies": (0,), "settings": (0, 2)}
# What no family has: other commands, and options that need others to have an effect.
LINES = {
    "arm": (
        "view IN --out out.html",
        "loop IN --find",
        "plot out.svg --ease smoothstep",
        "plot out.svg --integrators",
        "plot out.svg --through 0,1,0.5 --tangents catmull-rom",
        "simulate particles IN out.glb --node * --duration 0.1 --drag 1 --turbulence 1 --floor 0",
    ),
    "morph_cube": (
        "simulate particles IN out.glb --node * --duration 0.1 --emit surface --as skin",
        "optimize IN out.glb --effort fast --jobs 1 --max-bytes 1kB",
        "simulate rigid IN out.glb --body * --duration 0.1 --floor -1",
    ),
    "flag": (
        "simulate cloth IN out.glb --mesh flag --pin x-min --duration 0.05 --wind 1,0,0",
        "simulate cloth IN out.npz --mesh flag --pin x-min --duration 0.05 --solver mass-spring --step 1/3000",
        "simulate cloth IN out.pc2 --mesh flag --pin x-min --duration 0.05 --solver relaxation",
    ),
}


def option_jobs(commands: Sequence[str], seed: int) -> list[Job]:
    """Return a job for each command line, option and value, in an order by chance; all commands if none is given."""
    found = [
        Job([*line, f"{option}={value}"], files, option)
        for line, files in ((job.line, job.files) for job in plain_jobs(commands))
        for option in value_options(line)
        for value in VALUES
    ]
    Random(seed).shuffle(found)
    return found


def plain_jobs(commands: Sequence[str] = ()) -> list[Job]:
    """Return a job for each command line, as it is. commands: "trim", "simulate", "simulate cloth"; all if none.

    Raises SystemExit for one without a command line.
    """
    found = {" ".join(line): Job(line, each.files) for each in _seeds() for line in _lines(each)}
    for each in commands:
        if not any(line.startswith(f"{each} ") for line in found):
            raise SystemExit(f"no command line of '{each}'")
    chosen = tuple(f"{each} " for each in commands or {line.split()[0] for line in found})
    return [job for line, job in found.items() if line.startswith(chosen)]


def _seeds() -> Iterator[Seed]:
    for family, numbers in SEEDS.items():
        yield from (seeds(family)[number] for number in numbers)
    for name, lines in LINES.items():
        files = fixtures.build_files(name)
        yield Seed(next(iter(files)), files, (), lines)


def _lines(sound: Seed) -> Iterator[list[str]]:
    return (command_words(line, sound.main) for line in sound.lines)


def value_options(line: Sequence[str]) -> list[str]:
    """Return the options of a command line's command that take a value and name no file."""
    command: Any = typer.main.get_command(main.app)
    for word in line:
        if not hasattr(command, "table"):
            break
        command = command.get_command(None, word)
    return [
        param.opts[0]
        for param in command.params
        if param.param_type_name == "option"
        and not (param.is_flag or param.opts[0] == OUTPUT or FILES.search(param.metavar or ""))
    ]


def shorten(job: Job, is_same: Callable[[Job], bool]) -> Job:
    """Return a job without the options that its fault does not need. One without --out would open a browser."""
    *line, swept = job.line
    for option in [word for word in line if word.startswith("-") and word != OUTPUT]:
        at = line.index(option)
        end = next((k for k in range(at + 1, len(line)) if line[k].startswith("-")), len(line))
        shorter = Job([*line[:at], *line[end:], swept], job.files, job.option)
        if is_same(shorter):
            line = [*line[:at], *line[end:]]
    return Job([*line, swept], job.files, job.option)
