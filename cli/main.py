"""Table of commands, and a command group with lazy imports."""

from __future__ import annotations

import difflib
import gc
import importlib
import inspect
import os
import signal
import sys
import warnings
from collections.abc import Mapping
from contextlib import suppress
from typing import Annotated, Any, ClassVar, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup

from anim import __version__
from cli.signals import install_handlers
from cli.typer_options import Command, Parsing, set_parsers

PROGRAM = "gltf-anim"


class CommandInfo(NamedTuple):
    """One command: its line in `--help`, and the examples at the end of its own help."""

    about: str
    examples: tuple[str, ...]


COMMANDS = {
    "inspect": CommandInfo(
        "Show the contents of files, with findings and advice.",
        (
            "gltf-anim inspect walk.glb",
            "gltf-anim inspect *.glb --format json > report.json",
            "gltf-anim inspect hero.glb --clip 'Run*' --tracks",
            "gltf-anim inspect *.glb --fail-on error > health.txt",
        ),
    ),
    "check": CommandInfo(
        "Check files by rules, and fail on errors.",
        (
            "gltf-anim check walk.glb hero.glb",
            "gltf-anim check . --fail-on warning --ignore GA113",
            "gltf-anim check --explain GA101",
            "gltf-anim check '**/*.glb' --format sarif > findings.sarif",
        ),
    ),
    "run": CommandInfo(
        "Run recipes over many files: cached, on all cores.",
        (
            "gltf-anim run",
            "gltf-anim run crowd --recipe small --jobs 4",
            "gltf-anim run --resume --no-cache",
        ),
    ),
    "sample": CommandInfo(
        "Sample the pose of every node at chosen times.",
        (
            "gltf-anim sample walk.glb --at 0.5",
            "gltf-anim sample walk.glb poses.npz --fps 60 --space world",
            "gltf-anim sample walk.glb --fps 30 --node '*Foot*' --format csv",
        ),
    ),
    "resample": CommandInfo(
        "Resample clips to a regular grid of frames.",
        (
            "gltf-anim resample walk.glb walk30.glb --fps 30",
            "gltf-anim resample hero.glb hero.glb --fps 24 --clip 'Run*' --dry-run",
            "cat walk.glb | gltf-anim resample --fps 30 | gltf-anim inspect",
            "gltf-anim resample . -o 'out/{path}' --fps 30",
        ),
    ),
    "from-euler": CommandInfo(
        "Convert Euler tracks (BVH, CSV, JSON) to glTF.",
        (
            "gltf-anim from-euler walk.bvh walk.glb --skeleton-mesh sticks",
            "gltf-anim from-euler walk.bvh hero-walk.glb --onto hero.glb --fail-unmatched 12",
            "gltf-anim from-euler curves.csv door.glb --order XYZ --axes extrinsic --unit deg",
        ),
    ),
    "to-euler": CommandInfo(
        "Write a clip as continuous Euler curves: BVH, CSV or JSON.",
        (
            "gltf-anim to-euler hero.glb walk.bvh --clip walk --fps 30",
            "gltf-anim to-euler door.glb door.csv --order XYZ --axes extrinsic",
            "gltf-anim to-euler door.glb door.json --angle-tolerance 0.1deg",
        ),
    ),
    "ease": CommandInfo(
        "Change the speed of motion between keys by an easing.",
        (
            "gltf-anim ease --list",
            "gltf-anim ease poses.glb eased.glb --ease smoothstep",
            "gltf-anim ease walk.glb slow-in.glb --per range --ease 'cubic-bezier(.2, 0, 0, 1)' --clip walk",
        ),
    ),
    "spline": CommandInfo(
        "Put smooth curves through keys, by a tangent rule.",
        (
            "gltf-anim spline poses.glb smooth.glb",
            "gltf-anim spline walk.glb loop.glb --tangents natural --cyclic",
            "gltf-anim spline face.glb face2.glb --tangents monotone --path weights",
        ),
    ),
    "retime": CommandInfo(
        "Change the timing of clips: speed, duration, direction, delay.",
        (
            "gltf-anim retime walk.glb slow.glb --speed 0.25",
            "gltf-anim retime walk.glb back.glb --reverse --clip walk",
            "gltf-anim retime walk.glb pendulum.glb --warp sine-in-out --ping-pong",
        ),
    ),
    "trim": CommandInfo(
        "Keep one time range of clips.",
        (
            "gltf-anim trim walk.glb step.glb --from 0.25 --to 0.75 --rebase",
            "gltf-anim trim . -o 'out/{path}' --rebase",
        ),
    ),
    "loop": CommandInfo(
        "Report whether clips loop, and close them.",
        (
            "gltf-anim loop walk.glb",
            "gltf-anim loop walk.glb --find --format json",
            "gltf-anim loop walk.glb closed.glb --blend 0.2",
        ),
    ),
    "bake": CommandInfo(
        "Bake skinning and morph targets to vertex caches.",
        (
            "gltf-anim bake walk.glb walk.npz --method dqs --fps 30",
            "gltf-anim bake hero.glb 'caches/{clip}.usdc' --fps 24 --normals",
            "gltf-anim bake face.glb face.npz --clip talk --mesh Head --space mesh",
        ),
    ),
    "plot": CommandInfo(
        "Plot the curves of tracks, of easings, or of tangent rules.",
        (
            "gltf-anim plot walk.glb walk.png --clip walk --node 'Hip*'",
            "gltf-anim plot walk.glb walk.svg --compare walk30.glb --path rotation",
            "gltf-anim plot --ease smoothstep --ease 'cubic-bezier(.2,0,0,1)' eases.svg",
            "gltf-anim plot --through 0,0.9,0.2,1 --tangents catmull-rom --tangents natural curve.svg",
            "gltf-anim plot --integrators --omega 20 --step 1/60 stability.png",
            "gltf-anim plot walk.glb --terminal --limit 2",
        ),
    ),
    "view": CommandInfo(
        "Show files as a page that plays them, or compares two.",
        (
            "gltf-anim view walk.glb -o walk.html",
            "gltf-anim view walk.glb walk30.glb -o compared.html --show heat,bones",
            "gltf-anim view hero.glb -o hip.html --clip 'Run*' --node Hips --at 0.25 --show curves",
            "gltf-anim view walk.bvh -o motion.html",
        ),
    ),
    "collapse": CommandInfo(
        "Find where skin collapses, and compare skinning methods.",
        (
            "gltf-anim collapse hero.glb",
            "gltf-anim collapse hero.glb --clip 'Attack*' --method lbs --method cor --format json",
            "gltf-anim collapse arm.glb --plot arm.png",
        ),
    ),
    "convert-cache": CommandInfo(
        "Convert a vertex cache to another format.",
        (
            "gltf-anim convert-cache walk.npz walk.pc2 --up z --vertex-order blender",
            "gltf-anim convert-cache walk.npz walk.glb --max-error 0.5mm --quantize",
            "gltf-anim convert-cache walk.mdd walk.exr --preset godot --depth half",
        ),
    ),
    "render": CommandInfo(
        "Draw clips as a filmstrip or as an animated image.",
        (
            "gltf-anim render walk.glb walk.png",
            "gltf-anim render arm.glb twist.png --method lbs --method dqs --heat --clip twist",
            "gltf-anim render walk.npz walk.webp --frames 24",
            "gltf-anim render walk.glb --terminal --at 0.2 --at 0.4",
        ),
    ),
    "simulate": CommandInfo(
        "Simulate motion from forces, and bake it to keys.",
        ("gltf-anim simulate particles walk.glb sparks.glb --node head --floor 0",),
    ),
    "optimize": CommandInfo(
        "Make animations smaller, within an error that no vertex exceeds.",
        (
            "gltf-anim optimize hero.glb small.glb --max-error 0.1%",
            "gltf-anim optimize hero.glb small.glb --max-error 0.5mm --meshopt ext --drop rest --report small.json",
            "gltf-anim optimize hero.glb small.glb --max-bytes 260kB --effort fast",
            "gltf-anim optimize hero.glb --curve size-against-error.csv --effort fast",
        ),
    ),
    "diff": CommandInfo(
        "Measure the difference between the motion of two files.",
        (
            "gltf-anim diff walk.glb walk30.glb",
            "gltf-anim diff walk.glb walk30.glb --plot error.png --player three",
            "gltf-anim diff walk.glb walk30.glb --fail-above 20% --format json > diff.json",
        ),
    ),
    "convert": CommandInfo(
        "Convert between .glb and .gltf, or to skinned USD.",
        (
            "gltf-anim convert walk.glb walk.gltf",
            "gltf-anim convert scene/walk.gltf - | gltf-anim inspect",
            "gltf-anim convert walk.glb walk.usdz --fps 30",
        ),
    ),
}


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
    "can't be read or written, 4 unsupported input, 5 no such clip, node or mesh, 6 a check failed.",
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
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the matrix products are small: more threads only cost time
    gc.disable()  # one short job over many long-lived objects: collection only costs time
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # of packages: they are for programmers, and stderr is for messages
    with suppress(ImportError):  # raised again, and reported, when the command runs
        _import_command(sys.argv[1:])
    received = install_handlers()
    code = run(sys.argv[1:])
    code = 128 + received[0] if received else code
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, AttributeError):  # closed by the parent process
            stream.flush()
    os._exit(code)  # without deallocating all objects first


def _import_command(args: list[str]) -> None:
    """Import the command's module, while signals still end the process at once."""
    name = next((each for each in args if not each.startswith("-")), "")
    if name in COMMANDS:
        importlib.import_module(f"{LazyGroup.package}.{name.replace('-', '_')}")


def run(args: list[str]) -> int:
    """Run one command line and return its exit code; errors are written to stderr."""
    from cli import errors

    command = typer.main.get_command(app)
    return errors.run_guarded(lambda: command.main(args or ["--help"], prog_name=PROGRAM, standalone_mode=False), args)


if __name__ == "__main__":
    main()
