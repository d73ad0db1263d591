"""Option values without pydantic: typer loads it for the first value of any command, which doubles our start-up.

The values that our commands take are strings, numbers, choices and lists of them; those are converted here, with
messages in our own words. A parameter of any other type is left to typer.
"""

from __future__ import annotations

import difflib
import math
import types
import typing
from enum import Enum
from typing import Any

import typer
from typer import TyperException

from anim.errors import not_written


class Plain:
    """Converts the value of one parameter: what typer asks of its own converters."""

    def __init__(self, kind: type, *, many: bool, limits: tuple[float | None, float | None] = (None, None)) -> None:
        self._kind = kind
        self._many = many
        self._least, self._most = limits

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """Return `value` as the parameter's type, a list where it may be repeated; None stays None."""
        if value is None or (self._many and not value):
            return [] if self._many and param.required else None
        if self._many:
            return [self._one(each, param, ctx) for each in value]
        return self._one(value, param, ctx)

    def _one(self, value: Any, param: Any, ctx: Any) -> Any:
        if isinstance(value, self._kind):
            return value
        try:
            converted = self._kind(value)
        except ValueError:
            raise typer.BadParameter(_refusal(value, self._kind), ctx=ctx, param=param) from None
        if isinstance(converted, float) and not math.isfinite(converted):
            raise typer.BadParameter(f"'{value}' is no finite number", ctx=ctx, param=param)
        if self._least is not None and converted < self._least:
            raise typer.BadParameter(f"{value} is too small (expected at least {self._least:g})", ctx=ctx, param=param)
        if self._most is not None and converted > self._most:
            raise typer.BadParameter(f"{value} is too large (expected at most {self._most:g})", ctx=ctx, param=param)
        return converted


def quicken(command: Any) -> Any:
    """Return the command, its parameters of plain types, and its --help, made to convert themselves.

    What --help says of their types is made plain too, and every refusal knows which command it is about.
    """
    for param in command.params:
        _quickened(param)
    help_option, parse = command.get_help_option, command.parse_args
    command.get_help_option = lambda ctx: _with_our_stdout(_quickened(help_option(ctx)))
    command.parse_args = lambda ctx, args: _parsed(parse, ctx, args)
    return command


def _with_our_stdout(help_option: Any) -> Any:
    """The option --help, its page written as every other product is: whole, or one line that says why not."""
    if help_option is not None:
        help_option.callback = _show_help
    return help_option


def _show_help(ctx: Any, param: Any, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        from cli.io import stdout

        stdout.write_text(f"{ctx.get_help()}\n")
        ctx.exit()


def _parsed(parse: Any, ctx: Any, args: list[str]) -> Any:
    try:
        return parse(ctx, args)
    except TyperException as error:
        if getattr(error, "ctx", None) is None:
            error.ctx = ctx  # type: ignore[attr-defined]
        raise
    except OSError as error:  # of typer's own --show-completion and --install-completion
        raise not_written(error.filename or "stdout", error) from None


def _quickened(param: Any) -> Any:
    descriptor = getattr(param, "type_descriptor", None)
    plain = _plain(descriptor) if descriptor is not None else None
    if plain is None:
        return param
    shown = param.display_type_rich
    is_argument = param.param_type_name == "argument"
    param.get_runtime_param = lambda: plain
    param.display_type_rich = lambda ctx: "" if is_argument else _type_shown(shown(ctx))
    return param


def _type_shown(words: str) -> str:
    """What --help calls a type: "<list[a|b]>" → "<a|b>", "<float>" → "N"."""
    plain = words.replace("list[", "").replace("]", "")
    return {"<str>": "TEXT", "<int>": "N", "<float>": "N"}.get(plain, plain)


def _plain(descriptor: Any) -> Plain | None:
    annotation, about = descriptor.annotation, descriptor.parameter_info
    kinds = [annotation]
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        kinds = [kind for kind in typing.get_args(annotation) if kind is not type(None)]
    if len(kinds) != 1:
        return None
    kind, many = kinds[0], False
    if typing.get_origin(kind) is list:
        kind, many = typing.get_args(kind)[0], True
    known = isinstance(kind, type) and (kind in (str, int, float, bool) or issubclass(kind, Enum))
    return Plain(kind, many=many, limits=(about.min, about.max)) if known and not about.clamp else None


def _refusal(value: str, kind: type) -> str:
    if issubclass(kind, Enum):
        choices = [str(member.value) for member in kind]
        near = difflib.get_close_matches(value, choices, n=1)
        hint = f" Did you mean '{near[0]}'?" if near else ""
        return f"'{value}' is none of {', '.join(choices)}.{hint}"
    return f"'{value}' is no {'whole number' if kind is int else 'number'}"
