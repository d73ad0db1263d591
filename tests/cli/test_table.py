"""The table of commands: every one has its module, its test, its line in the README, and examples that run."""

from __future__ import annotations

import json
import re
import shlex
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
import typer

import cli.commands
from anim.errors import RangeError
from cli import main
from cli.command_table import COMMANDS
from cli.commands import simulate
from cli.typer_options import name_options
from docs import pages
from tests.cli.conftest import Call
from tests.cli.running import ROOT, built
from tests.fixtures.reading import split
from tests.pages import missing as pages_missing

EXAMPLES = [(command, example) for command, row in COMMANDS.items() for example in row.examples]
EXAMPLES += [("simulate", example) for row in simulate.KINDS.values() for example in row.examples]
# Command lines that make files which examples read.
MAKING = (
    "convert scene/walk.glb scene/walk.gltf",
    "resample walk.glb walk30.glb --fps 30",
    "from-euler curves.csv door.glb --order XYZ --axes extrinsic --unit deg",
    "bake walk.glb walk.npz",
    "bake walk.glb walk.mdd --fps 24",
)
BVH = """HIERARCHY
ROOT hips
{
  OFFSET 0 96 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT chest
  {
    OFFSET 0 40 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 20 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.033333
0 96 0 0 0 0 0 0 0
1 96 0 0 0 30 0 20 0
"""
RECIPE = '[[recipe]]\nname = "small"\nmatch = "crowd/*.glb"\nsteps = ["resample --fps 4"]\nout = "build/{path}"\n'
CURVES = "time,door.rx,door.ry,door.rz\n0,0,0,0\n1,90,0,0\n"


def module(command: str) -> str:
    return command.replace("-", "_")


def test_every_command_is_a_module_and_every_module_a_command() -> None:
    folder = Path(next(iter(cli.commands.__path__)))
    found = {path.stem for path in (*folder.glob("*.py"), *folder.glob("[a-z]*/"))} - {"__init__"}
    assert found == {module(command) for command in COMMANDS}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_tested_under_its_name(command: str) -> None:
    assert (ROOT / "tests" / "cli" / f"test_{module(command)}.py").is_file()


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_in_the_readme(command: str) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert re.search(rf"gltf-anim {command}\b", text), f"add a line to the README for {command}"


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_has_the_examples_of_the_table(command: str, call: Call) -> None:
    row = COMMANDS[command]
    text = " ".join(call(command, "--help").product().decode().split())
    assert f"Usage: gltf-anim {command}" in text
    assert row.examples
    for example in row.examples:
        assert " ".join(example.split()) in text
    assert " ".join((command, row.about)) in " ".join(call("--help").product().decode().split())


def test_an_option_takes_the_same_kind_of_value_in_all_commands() -> None:
    kinds: dict[str, set[str]] = {}
    group = typer.main.get_command(main.app)
    for command in COMMANDS:
        for param in group.get_command(None, command).params:  # type: ignore[attr-defined]
            kind = "flag" if getattr(param, "is_flag", False) else str(param.metavar)
            for option in param.opts if param.param_type_name == "option" else ():
                kinds.setdefault(option, set()).add("choice" if kind.startswith("<") else kind)
    assert len(kinds) > 60
    assert not {option: sorted(found) for option, found in kinds.items() if len(found) > 1}


def test_errors_of_the_library_name_options_instead_of_parameters() -> None:
    error = RangeError("`fps` and `times` exclude each other", help="see `EASINGS`")
    name_options(error, {"fps": "--samples-per-second"})
    assert str(error) == "--samples-per-second and times exclude each other"
    assert error.help == "see gltf-anim ease --list"


@pytest.mark.parametrize("command", COMMANDS)
def test_types_are_not_shown_as_python_has_them(command: str, call: Call) -> None:
    text = call(command, "--help").product().decode()
    assert not re.search(r"<(str|int|float)>|list\[", text)


def test_no_arguments_show_the_help(call: Call) -> None:
    assert call().product() == call("--help").product() == call("-h").product()


def test_the_version_is_one_line(call: Call) -> None:
    assert re.fullmatch(r"gltf-anim \d+\.\d+\.\d+\S*\n", call("--version").product().decode())


def test_the_exit_codes_are_in_the_help(call: Call) -> None:
    text = " ".join(call("--help").product().decode().split())
    assert (
        "0 done, 2 wrong usage, 3 invalid input, or a file that isn't there or can't be read or written, 4 unsupported"
        in text
    )


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a file of every name that examples use; their clips and nodes have names that examples choose."""
    folder = tmp_path_factory.mktemp("examples")
    for name in ("scene", "caches", "crowd"):
        (folder / name).mkdir()
    for name, data in {
        "walk.glb": renamed(built("biped"), ["walk"]),
        "scene/walk.glb": renamed(built("biped"), ["walk"]),
        "crowd/walk.glb": renamed(built("biped"), ["walk"]),
        "hero.glb": renamed(built("biped"), ["walk", "Run_fast", "Attack_high"]),
        "face.glb": renamed(built("morph_cube"), ["talk"]),
        "arm.glb": built("arm"),
        "flag.glb": built("flag"),
        "wall.glb": built("wall"),
        "poses.glb": built("interpolations"),
        "ponytail.glb": built("ponytail"),
    }.items():
        (folder / name).write_bytes(data)
    (folder / "walk.bvh").write_text(BVH)
    (folder / "curves.csv").write_text(CURVES)
    (folder / "gltf-anim.toml").write_text(RECIPE)
    for line in MAKING:
        if line.split()[0] in COMMANDS:
            pages.run_here(f"gltf-anim {line}", folder)  # where one fails, only the examples that need it do
    return folder


def renamed(data: bytes, clips: Sequence[str]) -> bytes:
    """The GLB with its first clips only, under other names, and nodes and meshes as examples call them."""
    document, blob = split(data)
    document["animations"] = [{**a, "name": name} for a, name in zip(document["animations"], clips, strict=False)]
    for part in (*document["nodes"], *document["meshes"]):
        part["name"] = {"hips": "Hips", "cube": "Head"}.get(part["name"], part["name"].replace("_foot", "_Foot"))
    content = json.dumps(document).encode()
    content += b" " * (-len(content) % 4)
    chunks = struct.pack("<I4s", len(content), b"JSON") + content + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def example_cases() -> Iterator[Any]:
    """All examples; the quick set runs the first of each command, but of `optimize`, and the README's."""
    quick = {row.examples[0] for command, row in COMMANDS.items() if row.examples and command != "optimize"}
    quick |= {row.examples[0] for row in simulate.KINDS.values()}
    for command, example in EXAMPLES:
        yield pytest.param(command, example, id=example, marks=[] if example in quick else [pytest.mark.slow])


@pytest.mark.parametrize(("command", "example"), list(example_cases()))
def test_every_example_runs(command: str, example: str, examples: Path) -> None:
    if command == "view" and pages_missing():
        pytest.skip(pages_missing())
    words = shlex.split(example, comments=True)
    assert "gltf-anim" in words
    assert command in words
    before = {path: path.read_bytes() for path in examples.glob("walk.*")}
    code, text = pages.run_here(example, examples)
    assert code == 0, text
    assert "Traceback" not in text
    for path, data in before.items():  # what other examples read
        path.write_bytes(data)
