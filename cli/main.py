"""The command line: a command group with lazy imports, and the start of the process."""

from __future__ import annotations

import difflib
import importlib
import inspect
import os
import signal
import sys
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Annotated, Any, ClassVar

import typer
from typer.core import TyperCommand, TyperGroup

from anim import __version__
from cli.command_table import COMMANDS, CommandInfo
from cli.signals import install_handlers
from cli.typer_options import Command, Parsing, set_parsers

PROGRAM = "gltf-anim"
MATPLOTLIB_FOLDER = "MPLCONFIGDIR"
# Variables that packages refuse to start with if they are wrong; no output depends on them.
UNUSED_VARIABLES = ("MPLBACKEND", "NUMBA_NUM_THREADS", "SOURCE_DATE_EPOCH")


class LazyGroup(Parsing, TyperGroup):
    """Group of commands, one module each, imported on use.

    table: of the commands. package: of their modules. noun: one of them, for messages.
    """

    table: ClassVar[Mapping[str, CommandInfo]] = COMMANDS
    package: ClassVar[str] = "cli.commands"
    noun: ClassVar[str] = "command"

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands, in the table's order."""
        return list(self.table)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command, imported on demand, or its placeholder; None for an unknown name."""
        row = self.table.get(cmd_name)
        if row is None or cmd_name in self.commands:
            return self.commands.get(cmd_name)
        module = importlib.import_module(f"{self.package}.{cmd_name.replace('-', '_')}")
        epilog = "\b\nExamples:\n" + "\n".join(f"  {example}" for example in row.examples)
        if hasattr(module, "command"):
            single = typer.Typer(add_completion=False, rich_markup_mode=None)
            single.command(cmd_name, cls=Command, epilog=epilog)(set_parsers(module.command))
        else:  # a package with a command for each kind
            single = typer.Typer(cls=module.Group, add_completion=False, rich_markup_mode=None)
            words = inspect.cleandoc(module.Group.__doc__)
            single.callback(help=words, epilog=epilog, subcommand_metavar="KIND [IN] [OUT]")(lambda: None)
        return typer.main.get_command(single)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments; without any the help is shown."""
        return super().parse_args(ctx, args or ["--help"])

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Return the commands and options with this prefix; descriptions come from the table, without imports."""
        self.commands = {name: TyperCommand(name, short_help=row.about) for name, row in self.table.items()}
        return super().shell_complete(ctx, incomplete)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command named in `args`; a misspelled one raises an error, except in completion."""
        if args and args[0] not in self.table and not args[0].startswith("-") and not ctx.resilient_parsing:
            near = difflib.get_close_matches(args[0], self.table, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else f" The {self.noun}s are {', '.join(self.table)}."
            ctx.fail(f"no such {self.noun} '{args[0]}'.{hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the table of commands without importing any."""
        with formatter.section(f"{self.noun.capitalize()}s"):
            formatter.write_dl([(name, row.about) for name, row in self.table.items()])


app = typer.Typer(
    cls=LazyGroup,
    rich_markup_mode=None,
    add_completion=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="IN and OUT may be '-' for a pipe (GLB). Exit codes: 0 done, 2 wrong usage, 3 invalid input, or a file that "
    "isn't there or can't be read or written, 4 unsupported input, 5 no such clip, node or mesh, 6 a check failed.",
)


def _version(wanted: bool) -> None:
    if wanted:
        from cli.io import stdout

        stdout.write_text(f"{PROGRAM} {__version__}\n")
        raise typer.Exit


@app.callback()
def gltf_anim(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """The command-line workbench for glTF 2.0 animation: inspect, edit, bake and draw clips."""


def main() -> None:
    """Run the command line of this process and exit with its exit code."""
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # `| head` ends the process silently, as for other tools
    folder = os.environ.get(MATPLOTLIB_FOLDER)
    for name in UNUSED_VARIABLES:
        os.environ.pop(name, None)
    # The matrix products are small: more threads only cost time, and on some processors they change the last digits.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # of packages: they are for programmers, and stderr is for messages
    with suppress(ImportError):  # raised again, and reported, when the command runs
        _import_command(sys.argv[1:])
    received = install_handlers()
    code = run(sys.argv[1:], received)
    code = 128 + received[0] if received else code
    _remove_temporary_folder(folder)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, AttributeError):  # closed by the parent process
            stream.flush()
    os._exit(code)  # without deallocating all objects first


def _remove_temporary_folder(before: str | None) -> None:
    """Remove the folder that matplotlib makes where the home folder can't be written, and puts into the environment.

    It would do so itself at an exit other than `os._exit`. before: the variable at the start.
    """
    made = os.environ.get(MATPLOTLIB_FOLDER)
    if made is not None and made != before:
        import shutil
        import tempfile

        if os.path.dirname(made) == tempfile.gettempdir():
            shutil.rmtree(made, ignore_errors=True)


def _import_command(args: list[str]) -> None:
    """Import the command's module, while signals still end the process at once."""
    name = next((each for each in args if not each.startswith("-")), "")
    if name in COMMANDS:
        importlib.import_module(f"{LazyGroup.package}.{name.replace('-', '_')}")


def run(args: list[str], received: Sequence[int] = ()) -> int:
    """Run one command line and return its exit code; errors are written to stderr.

    received: numbers of the signals that came.
    """
    from cli import errors

    command = typer.main.get_command(app)
    return errors.run_guarded(
        lambda: command.main(args or ["--help"], prog_name=PROGRAM, standalone_mode=False), args, received
    )


if __name__ == "__main__":
    main()
