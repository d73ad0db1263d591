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


class Plain:
    """Converts the value of one parameter: what typer asks of its own converters."""

    def __init__(self, kind: type, *, many: bool) -> None:
        self._kind = kind
        self._many = many

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
        return converted


def quicken(command: Any) -> Any:
    """Return the command, its parameters of plain types, and its --help, made to convert themselves."""
    for param in command.params:
        _quickened(param)
    help_option = command.get_help_option
    command.get_help_option = lambda ctx: _quickened(help_option(ctx))
    return command


def _quickened(param: Any) -> Any:
    plain = _plain(getattr(getattr(param, "type_descriptor", None), "annotation", None))
    if plain is not None:
        param.get_runtime_param = lambda: plain
    return param


def _plain(annotation: Any) -> Plain | None:
    kinds = [annotation]
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        kinds = [kind for kind in typing.get_args(annotation) if kind is not type(None)]
    if len(kinds) != 1:
        return None
    kind, many = kinds[0], False
    if typing.get_origin(kind) is list:
        kind, many = typing.get_args(kind)[0], True
    known = isinstance(kind, type) and (kind in (str, int, float, bool) or issubclass(kind, Enum))
    return Plain(kind, many=many) if known else None


def _refusal(value: str, kind: type) -> str:
    if issubclass(kind, Enum):
        choices = [str(member.value) for member in kind]
        near = difflib.get_close_matches(value, choices, n=1)
        hint = f" Did you mean '{near[0]}'?" if near else ""
        return f"'{value}' is none of {', '.join(choices)}.{hint}"
    return f"'{value}' is no {'whole number' if kind is int else 'number'}"
