"""Options for typer: parsers and metavars by type, error messages, options named in library errors."""

from __future__ import annotations

import difflib
import math
import os
import re
import typing
from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import Path
from typing import Any

import typer
from typer import TyperException
from typer.core import TyperCommand, TyperOption
from typer.models import ArgumentInfo, OptionInfo

from anim import units
from anim.errors import AnimError, RangeError, not_written
from anim.files.special_files import descriptor_of

OUTPUTS = ("output", "files")  # parameters whose value, or last value, is OUT
OTHER_OUTPUTS = ("report", "html", "plot", "curve_file", "write_known")  # parameters with the names of other outputs
OUT = "OUT"  # in messages
STDOUT = 1  # its descriptor
DEPFILE = "gltf_anim.depfile"  # key of the context
MEMORY_LIMIT = "gltf_anim.memory_limit"  # key of the context
METAVARS = {str: "TEXT", int: "N", float: "N"}
MAX_INTEGER = 1e18  # of arrays' 64 bits; no count is as large
LISTINGS = {"EASINGS": "gltf-anim ease --list", "TANGENTS": "gltf-anim spline --list"}  # by the library's table


class Parsing:
    """Base of the group and the commands: complete help pages, and errors with their command."""

    def get_help_option(self, ctx: Any) -> Any:
        """Return the option --help, with its page written completely or an error raised."""
        option = super().get_help_option(ctx)  # type: ignore[misc]
        if option is not None:
            option.callback = _show_help
        return option

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments after the command's name."""
        try:
            parsed: list[str] = super().parse_args(ctx, args)  # type: ignore[misc]
        except TyperException as error:
            if getattr(error, "ctx", None) is None:
                error.ctx = ctx  # type: ignore[attr-defined]
            raise
        except OSError as error:  # of typer's own --show-completion and --install-completion
            raise not_written(error.filename or "stdout", error) from None
        return parsed


class Command(Parsing, TyperCommand):
    """Command with a help page that shows arguments without a type, and with its options named in errors."""

    def __init__(self, *args: Any, **settings: Any) -> None:
        super().__init__(*args, **settings)
        self.params.append(_memory_option())
        if any(each.name in OUTPUTS for each in self.params):
            self.params.append(_depfile_option())

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments; values with units are checked here, so that steps of recipes are before any runs."""
        parsed = super().parse_args(ctx, args)
        for each in self.params:
            if isinstance(value := ctx.params.get(each.name), str) and not ctx.resilient_parsing:
                from cli.units import check_syntax

                check_syntax(each.metavar or "", value, max(each.opts, key=len))
        return parsed

    def invoke(self, ctx: Any) -> Any:
        """Run the command; errors of the library name its options instead of parameters."""
        import numpy as np

        from anim.memory import memory_limit

        for name in OUTPUTS:
            if isinstance(path := ctx.params.get(name), str) and _is_stdout(path):
                ctx.params[name] = "-"
        try:
            # Results that are not finite are errors where they are written.
            with np.errstate(all="ignore"), memory_limit(ctx.meta.get(MEMORY_LIMIT)):
                return self._invoke_guarded(ctx)
        except AnimError as error:
            options = {str(each.name): each.opts[0] for each in self.params if each.param_type_name == "option"}
            options.setdefault("fps", options.get("samples_per_second", "fps"))  # the rate of what is measured
            name_options(error, options)
            raise

    def _invoke_guarded(self, ctx: Any) -> Any:
        """Run a command so that none of its outputs replaces another file of it; write a dependency file with OUT."""
        outputs, others = self._output_names(ctx)
        run = super().invoke
        if not outputs:  # `run` has its own check of many commands' outputs
            return run(ctx)
        from anim.files import guard
        from cli.io import command_files

        command_files.check_names(outputs, others)
        path = ctx.meta.get(DEPFILE)
        with guard.use(files := command_files.CommandFiles()):
            if path is None:
                return run(ctx)
            from cli.io import depfile_output

            output, dry_run = outputs.get(OUT, ""), bool(ctx.params.get("dry_run"))
            depfile_output.check(path, output)
            return depfile_output.invoke(lambda: run(ctx), path, output, files, dry_run=dry_run)

    def _output_names(self, ctx: Any) -> tuple[dict[str, str], list[Any]]:
        """Return the names of outputs by option, "OUT" first, and the values of parameters that name other files."""
        outputs, others = dict[str, str](), list[Any]()
        for each in self.params:
            value = ctx.params.get(each.name)
            if each.name in OUTPUTS:
                *inputs, value = value if isinstance(value, list | tuple) and value else [value]
                others += inputs
                outputs = {OUT: value or "", **outputs}
            elif each.name in OTHER_OUTPUTS:
                outputs[each.opts[0]] = value or ""
            elif each.param_type_name == "argument" or "FILE" in (each.metavar or ""):
                others.append(value)
        return outputs and {**outputs, "--depfile": ctx.meta.get(DEPFILE) or ""}, others

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the tables of arguments and options."""
        for heading, kind in (("Arguments", "argument"), ("Options", "option")):
            rows = [(each, each.get_help_record(ctx)) for each in self.get_params(ctx) if each.param_type_name == kind]
            shown = [(each.metavar if kind == "argument" else row[0], row[1]) for each, row in rows if row]
            if shown:
                with formatter.section(heading):
                    formatter.write_dl(shown)


def _is_stdout(path: str) -> bool:
    """Return whether a path is another name of "-". A link with a file extension is none: it selects a format."""
    return not os.path.splitext(path)[1] and descriptor_of(Path(path)) == STDOUT


def _memory_option() -> TyperOption:
    """Option of every command, outside its function."""
    return TyperOption(
        param_decls=["--memory-limit"],
        type=str,
        metavar="SIZE",
        expose_value=False,
        callback=_set_memory_limit,
        help="Largest size of an input's decoded data: 4GB. Default: 1GB, or 64 times the file.",
    )


def _depfile_option() -> TyperOption:
    """Option of every command with an output, outside its function."""
    return TyperOption(
        param_decls=["--depfile"],
        type=str,
        metavar="FILE",
        expose_value=False,
        callback=_set_depfile,
        help="Write a rule of make or ninja: OUT, and all files that were read for it.",
    )


def _set_depfile(ctx: Any, param: Any, value: str | None) -> None:
    if value is not None:
        ctx.meta[DEPFILE] = value


def _set_memory_limit(ctx: Any, param: Any, value: str | None) -> None:
    if value is not None:
        try:
            ctx.meta[MEMORY_LIMIT] = units.parse_size(value, "--memory-limit")
        except RangeError as error:
            raise typer.BadParameter(error.problem) from None


def name_options(error: AnimError, options: Mapping[str, str]) -> None:
    """Replace every `parameter` in an error by the option for it; without one, remove the quotes.

    "choose `fps`", {"fps": "--fps"} → "choose --fps"
    """
    names = {**LISTINGS, **options}
    error.problem, error.help = (
        re.sub(r"`(\w+)`", lambda found: names.get(found[1], found[1]), words) for words in (error.problem, error.help)
    )


def _show_help(ctx: Any, param: Any, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        from cli.io import stdout

        stdout.write_text(f"{ctx.get_help()}\n")
        ctx.exit()


def set_parsers(function: Callable[..., Any]) -> Callable[..., Any]:
    """Set the parser, and a missing metavar, of every text, number and choice option of a command."""
    function.__annotations__ = typing.get_type_hints(function, include_extras=True)
    for hint in function.__annotations__.values():
        kind, *extras = typing.get_args(hint) or (hint,)
        for info in extras:
            if isinstance(info, OptionInfo | ArgumentInfo):
                _set_parser(info, _value_type(kind))
    return function


def _set_parser(info: OptionInfo | ArgumentInfo, kind: Any) -> None:
    if info.parser is not None:  # of an option that an earlier command has too
        return
    if issubclass(kind, Enum):
        choices = {str(member.value): member for member in kind}
        info.parser = lambda value: _choice(value, choices)
        info.autocompletion = _complete(list(choices))
        info.metavar = info.metavar or f"<{'|'.join(choices)}>"
    elif kind in METAVARS:
        if kind is not str:
            low, high = info.min, info.max
            info.parser = lambda value: _number(value, kind, low, high)
            info.help = _with_range(info.help or "", low, high)
            info.min = info.max = None  # some versions of typer show them too, beside a parser
        info.metavar = info.metavar or METAVARS[kind]


def _complete(choices: list[str]) -> Callable[[str], list[str]]:
    def complete(incomplete: str) -> list[str]:
        return [each for each in choices if each.startswith(incomplete)]

    return complete


def _with_range(words: str, low: float | None, high: float | None) -> str:
    """The help of an option and its range: "Height of a frame (from 32 to 4096)." """
    if low is None and high is None:
        return words
    limits = [f"{word} {limit:g}" for word, limit in (("from", low), ("to", high)) if limit is not None]
    return f"{words.removesuffix('.')} ({' '.join(limits)})."


def _value_type(hint: Any) -> Any:
    """Type of one value: `float` of `float | None`, `str` of `list[str] | None`."""
    kinds = [each for each in typing.get_args(hint) if each is not type(None)]
    return _value_type(kinds[0]) if kinds else hint


def _choice(value: Any, choices: dict[str, Enum]) -> Enum:
    if isinstance(value, Enum):  # a default
        return value
    if value not in choices:
        near = difflib.get_close_matches(value, choices, n=1)
        hint = f" Did you mean '{near[0]}'?" if near else ""
        raise typer.BadParameter(f"'{value}' is none of {', '.join(choices)}.{hint}")
    return choices[value]


def _number(value: Any, kind: type, low: float | None, high: float | None) -> float:
    try:
        number: float = kind(value)
    except ValueError:
        named = "whole number" if kind is int else "number"
        digits = r"\d+" if kind is int else r"\d*\.?\d+"
        found = re.fullmatch(rf"({digits}) ?(?:[a-z]+|%)", str(value).lower())
        hint = f" (expected {found[1]}, without a unit)" if found else ""
        raise typer.BadParameter(f"'{value}' is no {named}{hint}") from None
    if kind is int and abs(number) > MAX_INTEGER:
        raise typer.BadParameter(f"{value} is too large (expected at most {MAX_INTEGER:g})")
    if not math.isfinite(number):
        raise typer.BadParameter(f"'{value}' is no finite number")
    if low is not None and number < low:
        raise typer.BadParameter(f"{value} is too small (expected at least {low:g})")
    if high is not None and number > high:
        raise typer.BadParameter(f"{value} is too large (expected at most {high:g})")
    return number
