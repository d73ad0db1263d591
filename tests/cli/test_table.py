"""The table of commands: every one has its module, its test, its line in the README, and examples that run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

import cli.commands
from cli import main
from tests.cli.conftest import Call
from tests.cli.running import ROOT, built, shell

EXAMPLES = [(command, example) for command, row in main.COMMANDS.items() for example in row.examples]
# Examples that don't do what they say, and why.
FAILING = {"gltf-anim sample walk.glb poses.npz --fps 60 --space world": "NPZ holds one clip; other examples need two"}
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
CURVES = "time,door.rx,door.ry,door.rz\n0,0,0,0\n1,90,0,0\n"


def module(command: str) -> str:
    return command.replace("-", "_")


def test_every_command_is_a_module_and_every_module_a_command() -> None:
    folder = Path(next(iter(cli.commands.__path__)))
    found = {path.stem for path in folder.glob("*.py")} - {"__init__"}
    assert found == {module(command) for command in main.COMMANDS}


@pytest.mark.parametrize("command", main.COMMANDS)
def test_every_command_is_tested_under_its_name(command: str) -> None:
    assert (ROOT / "tests" / "cli" / f"test_{module(command)}.py").is_file()


@pytest.mark.parametrize("command", main.COMMANDS)
def test_every_command_is_in_the_readme(command: str) -> None:
    assert re.search(rf"gltf-anim {command}\b", (ROOT / "README.md").read_text(encoding="utf-8"))


@pytest.mark.parametrize("command", main.COMMANDS)
def test_the_help_has_the_examples_of_the_table(command: str, call: Call) -> None:
    row = main.COMMANDS[command]
    text = " ".join(call(command, "--help").product().decode().split())
    assert f"Usage: gltf-anim {command}" in text
    assert row.examples
    for example in row.examples:
        assert " ".join(example.split()) in text
    assert " ".join((command, row.about)) in " ".join(call("--help").product().decode().split())


@pytest.mark.parametrize("command", main.COMMANDS)
def test_types_are_not_shown_as_python_has_them(command: str, call: Call) -> None:
    text = call(command, "--help").product().decode()
    assert not re.search(r"<(str|list|int|float)\b", text)


def test_no_arguments_show_the_help(call: Call) -> None:
    assert call().product() == call("--help").product() == call("-h").product()


def test_the_version_is_one_line(call: Call) -> None:
    assert re.fullmatch(r"gltf-anim \d+\.\d+\.\d+\S*\n", call("--version").product().decode())


def test_the_exit_codes_are_in_the_help(call: Call) -> None:
    text = " ".join(call("--help").product().decode().split())
    assert "0 done, 2 usage, 3 bad input, 4 not handled, 5 no such clip or node, 6 a check said no" in text


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a file of every name that examples use; their clips and nodes have names that examples choose."""
    folder = tmp_path_factory.mktemp("examples")
    (folder / "scene").mkdir()
    for name, clip in {"walk.glb": b"idle", "hero.glb": b"Run2", "scene/walk.glb": b"wave"}.items():
        data = built("biped").replace(b'"wave"', b'"%s"' % clip)
        (folder / name).write_bytes(data.replace(b"_foot", b"_Foot").replace(b'"hips"', b'"Hips"'))
    for name, fixture in {"poses.glb": "interpolations", "face.glb": "morph_cube"}.items():
        (folder / name).write_bytes(built(fixture))
    (folder / "walk.bvh").write_text(BVH)
    (folder / "curves.csv").write_text(CURVES)
    for line in (
        "convert scene/walk.glb scene/walk.gltf",
        "resample walk.glb walk30.glb --fps 30",
        "from-euler curves.csv door.glb --order XYZ --frame extrinsic --unit deg",
    ):
        shell(f"gltf-anim {line}", folder).product()
    return folder


def test_the_failing_examples_are_still_there() -> None:
    assert set(FAILING) <= {example for _, example in EXAMPLES}


@pytest.mark.parametrize(
    ("command", "example"),
    [
        pytest.param(*each, id=each[1], marks=[pytest.mark.xfail(strict=True, reason=FAILING[each[1]])])
        if each[1] in FAILING
        else pytest.param(*each, id=each[1])
        for each in EXAMPLES
    ],
)
def test_every_example_runs(command: str, example: str, examples: Path) -> None:
    words = shlex.split(example, comments=True)
    assert "gltf-anim" in words
    assert command in words
    before = (examples / "walk.glb").read_bytes()
    run = shell(example, examples)
    assert run.code == 0, run.err
    assert "Traceback" not in run.err
    (examples / "walk.glb").write_bytes(before)
