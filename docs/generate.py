"""python -m docs.generate: write docs/commands.md, the reference of all commands, from their parameters."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import typer

from cli import main
from cli.command_table import COMMANDS

REFERENCE = Path(__file__).with_name("commands.md")
HEADER = """# Commands

Written by `make docs` from the commands themselves, as `gltf-anim COMMAND --help` shows them: do not edit.
"""


def reference() -> str:
    """Return the page: a table of all commands, then a section for each.

    It is built from the parameters, not from rendered help, so that no terminal's width and no version of typer shows.
    """
    group: Any = typer.main.get_command(main.app)
    context = group.make_context(main.PROGRAM, [], resilient_parsing=True)
    rows = [f"| [{name}](#{name}) | {_escaped(info.about)} |" for name, info in COMMANDS.items()]
    parts = [HEADER, "| command | |\n|---|---|", *rows, "", _paragraph(main.app.info.epilog)]
    for name, row in COMMANDS.items():
        command = group.get_command(context, name)
        parts += ["", *_section(name, command, row.examples, context)]
        for kind, info in getattr(command, "table", {}).items():
            parts += ["", *_section(f"{name} {kind}", command.get_command(context, kind), info.examples, context)]
    return "\n".join(parts) + "\n"


def _section(name: str, command: Any, examples: Sequence[str], context: Any) -> Iterator[str]:
    arguments = [each for each in command.params if each.param_type_name == "argument"]
    options = [each for each in command.params if each.param_type_name == "option" and not each.hidden]
    yield f"## {name}\n"
    for paragraph in command.help.split("\n\n"):
        yield f"{_paragraph(paragraph)}\n"
    kinds = [command.subcommand_metavar] if hasattr(command, "subcommand_metavar") else []
    usage = " ".join([main.PROGRAM, name, "[OPTIONS]", *kinds, *map(_usage, arguments)])
    yield f"```\n{usage}\n```\n"
    yield from (f"- `{each.metavar}`: {_escaped(each.help)}" for each in arguments)
    yield from (_option(each, context) for each in options)
    yield "\n```"
    yield from examples
    yield "```"


def _usage(argument: Any) -> str:
    if argument.metavar.startswith("["):
        return str(argument.metavar)
    many = "..." if argument.nargs == -1 and not argument.metavar.endswith("...") else ""
    return f"{argument.metavar}{many}" if argument.required else f"[{argument.metavar}{many}]"


def _option(option: Any, context: Any) -> str:
    names = ", ".join(sorted(option.opts, key=lambda each: each.startswith("--")))
    spelling = " / ".join([names, *option.secondary_opts]) + ("" if option.is_flag else f" {option.metavar}")
    details = list(_details(option, option.get_default(context)))
    return f"- `{spelling}`: {_escaped(option.help)}" + (f" ({'; '.join(details)})" if details else "")


def _details(option: Any, default: Any) -> Iterator[str]:
    if option.required:
        yield "required"
    if isinstance(option.show_default, str):
        yield f"default {option.show_default}"
    elif option.show_default and default is not None and not option.is_flag:
        yield f"default {getattr(default, 'value', default)}"


def _paragraph(text: str | None) -> str:
    if text and text.startswith("\b\n"):  # lines that the help keeps as they are
        return f"```\n{textwrap.dedent(text.partition(chr(10))[2])}\n```"
    return _escaped(" ".join((text or "").split()))


def _escaped(text: str) -> str:
    """Return the text as Markdown: options as code, special characters as they are."""
    parts = re.split(r"((?<![\w-])--?[a-z][a-z-]*)", text)
    return "".join(f"`{part}`" if i % 2 else re.sub(r"([*_<>|`\\])", r"\\\1", part) for i, part in enumerate(parts))


if __name__ == "__main__":
    REFERENCE.write_text(reference(), encoding="utf-8", newline="\n")
