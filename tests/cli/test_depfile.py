"""`--depfile`: rules that make and ninja read, with every file that an output depends on."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from cli import main
from cli.command_table import COMMANDS
from cli.commands import simulate
from cli.io import depfile
from tests.cli.conftest import Call, Find
from tests.cli.running import ENVIRONMENT, built, refusal, shell


@pytest.fixture
def character(tmp_path: Path, asset: Find, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A .gltf with a buffer and an image beside it, in a folder whose name has a space."""
    shutil.copytree(asset("CesiumMan-gltf/CesiumMan.gltf").parent, tmp_path / "in dir")
    monkeypatch.chdir(tmp_path)
    return Path("in dir/CesiumMan.gltf")


def rule(output: str, *inputs: str) -> str:
    """A rule, with a target for each input as well."""
    return f"{output}: {' '.join(inputs)}\n" + "".join(f"{each}:\n" for each in inputs)


@pytest.mark.parametrize(
    ("path", "escaped"),
    [
        ("a b.glb", r"a\ b.glb"),
        ("#1 $2.glb", r"\#1\ $$2.glb"),
        ("a\\ b", "a\\\\\\ b"),
        ("C:\\x.glb", "C:\\x.glb"),
        ("a:b.glb", r"a\:b.glb"),
        ("a:/b.glb", "a:/b.glb"),
        ("ab:/c.glb", r"ab\:/c.glb"),
        (":", r"\:"),
    ],
)
def test_names_are_escaped_as_by_compilers(path: str, escaped: str) -> None:
    assert depfile.escape(path) == escaped


def test_all_files_that_are_read_are_named(character: Path, call: Call) -> None:
    call("resample", character, "out.glb", "--fps", "30", "--depfile", "out.d").product()
    files = ("CesiumMan.gltf", "CesiumMan_data.bin", "CesiumMan_img0.jpg")
    assert Path("out.d").read_text() == rule("out.glb", *(rf"in\ dir/{name}" for name in files))


@pytest.mark.slow
def test_second_inputs_are_named_too(folder: Path, call: Call, asset: Find) -> None:
    (folder / "hero.glb").write_bytes(built("biped"))
    call("to-euler", "hero.glb", "walk.bvh", "--clip", "walk", "--depfile", "walk.d").product()
    assert Path("walk.d").read_text() == rule("walk.bvh", "hero.glb")
    call("from-euler", "walk.bvh", "out.glb", "--onto", "hero.glb", "--depfile", "out.d").product()
    assert Path("out.d").read_text() == rule("out.glb", "walk.bvh", "hero.glb")
    call("plot", "hero.glb", "plot.png", "--compare", "out.glb", "--depfile", "plot.d").product()
    assert Path("plot.d").read_text() == rule("plot.png", "hero.glb", "out.glb")


def test_outputs_with_placeholders_are_all_named(folder: Path, call: Call) -> None:
    call("bake", "crowd/arm 1.glb", "{clip}.npz", "--fps", "2", "--depfile", "bake.d").product()
    names, _, inputs = Path("bake.d").read_text().partition(":")
    assert sorted(names.split()) == sorted(path.name for path in folder.glob("*.npz"))
    assert inputs == " crowd/arm\\ 1.glb\ncrowd/arm\\ 1.glb:\n"
    first = names.split()[0]
    call("convert-cache", first, "out.pc2", "--depfile", "out.d").product()
    assert Path("out.d").read_text() == rule("out.pc2", first)


@pytest.mark.parametrize(
    ("output", "options", "problem"),
    [
        ("-", ["--depfile", "x.d"], "--depfile needs an output file: name OUT"),
        ("out.glb", ["--depfile", "out.glb"], "out.glb: --depfile would replace OUT (expected another file)"),
        ("out.glb", ["--depfile", "-"], "--depfile is '-' (expected a file name)"),
        ("out.gltf", ["--depfile", "out.bin"], "out.bin: two outputs would be written to this file"),
    ],
)
def test_wrong_names_are_refused(output: str, options: list[str], problem: str, folder: Path, call: Call) -> None:
    run = call("retime", "noop.glb", output, "--speed", "2", *options)
    assert (run.code, run.text) == (2, "")
    assert problem in run.err
    assert not (folder / "out.glb").exists()


def test_a_missing_folder_is_named_before_any_work(folder: Path, call: Call) -> None:
    run = call("trim", "noop.glb", "out.glb", "--to", "0.5", "--depfile", "none/x.d")
    assert (run.code, run.text) == (3, "")
    assert "none/x.d: there is no folder 'none'" in run.err
    assert not (folder / "out.glb").exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
@pytest.mark.parametrize(
    "line",
    [
        "retime noop.glb out.glb --speed 2",
        "convert noop.glb out.gltf",
        "bake 'crowd/arm 1.glb' out.npz --clip bend --fps 2",
        "sample noop.glb out.csv --at 0",
    ],
)
def test_outputs_stay_as_they_were_if_the_rule_cannot_be_written(line: str, folder: Path) -> None:
    """As on a full disk."""
    for name in ("out.glb", "out.gltf", "out.npz", "out.csv"):
        (folder / name).write_bytes(b"before")
    run = shell(f"gltf-anim {line} --depfile /dev/full", folder)
    assert refusal(run, 3) == "gltf-anim: /dev/full: can't be written (no space left on device)"
    assert {path.read_bytes() for path in folder.glob("out*")} == {b"before"}
    assert len(list(folder.glob("out*"))) == 4


def test_a_rule_for_a_pipe_is_written_once(folder: Path) -> None:
    run = shell("gltf-anim convert noop.glb out.glb -q --depfile /dev/stdout", folder)
    assert run.product().decode() == rule("out.glb", "noop.glb")
    run = shell("gltf-anim bake 'crowd/arm 1.glb' '{clip}.npz' -q --fps 2 --depfile /dev/stdout", folder)
    assert run.product().count(b".npz") == len(list(folder.glob("*.npz")))


def test_no_rule_is_left_if_the_output_cannot_be_written(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "x.d").write_text("before")
    replace = os.replace

    def fail(source: Path, target: Path) -> None:
        if target.name == "out.glb":
            raise OSError(28, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", fail)
    run = call("retime", folder / "noop.glb", folder / "out.glb", "--speed", "2", "--depfile", folder / "x.d")
    assert run.code == 3
    assert (folder / "x.d").read_text() == "before"
    assert not list(folder.glob(".*"))


def test_an_input_is_not_replaced(folder: Path, call: Call) -> None:
    before = (folder / "noop.glb").read_bytes()
    run = call("retime", "noop.glb", "out.glb", "--speed", "2", "--depfile", f"{folder}/noop.glb")
    assert (run.code, run.text) == (2, "")
    assert "noop.glb: --depfile would replace an input (expected another file)" in run.err
    assert (folder / "noop.glb").read_bytes() == before
    assert not (folder / "out.glb").exists()


def test_a_name_that_a_rule_cannot_hold_is_refused(folder: Path, call: Call) -> None:
    """A line break would be read as the start of another rule."""
    (folder / "new\nline.glb").write_bytes(built("noop"))
    for files in (("new\nline.glb", "out.glb"), ("noop.glb", "out\nput.glb")):
        before = sorted(folder.iterdir())
        run = call("retime", *files, "--speed", "2", "--depfile", "x.d")
        assert "can't hold a name with a line break" in refusal(run, 2)
        assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize("character", ["=", ";", "|"])
def test_a_name_that_make_takes_apart_is_refused(character: str, folder: Path, call: Call) -> None:
    run = call("retime", "noop.glb", f"out{character}1.glb", "--speed", "2", "--depfile", "x.d")
    assert f"can't hold a name with '{character}'" in refusal(run, 2)
    assert not (folder / "x.d").exists()


def test_a_sequence_is_named_by_its_first_frame(folder: Path, call: Call) -> None:
    """No file has the name of OUT: a rule for it would always be out of date."""
    call("bake", "crowd/arm 1.glb", "out.ply", "--clip", "bend", "--fps", "2", "--depfile", "x.d").product()
    name = min(path.name for path in folder.glob("out*.ply"))
    assert Path("x.d").read_text() == rule(name, r"crowd/arm\ 1.glb")
    call("bake", "crowd/arm 1.glb", "{clip}.ply", "--fps", "2", "--depfile", "x.d").product()
    names = Path("x.d").read_text().partition(":")[0].split()
    assert len(names) == 2
    assert all((folder / each).exists() for each in names)


def test_none_is_written_without_an_output(folder: Path, call: Call) -> None:
    assert call("retime", "noop.glb", "out.glb", "--speed", "2", "--depfile", "x.d", "--dry-run").code == 0
    assert call("trim", "none.glb", "out.glb", "--to", "0.5", "--depfile", "x.d").code == 3
    assert not (folder / "x.d").exists()


def commands() -> Iterator[tuple[str, Any]]:
    """All commands, and the kinds of simulation, by name."""
    group: Any = typer.main.get_command(main.app)
    for name in COMMANDS:
        yield name, group.get_command(None, name)
    kinds: Any = group.get_command(None, "simulate")
    for kind in simulate.Group.table:
        yield f"simulate {kind}", kinds.get_command(None, kind)


def test_every_writing_command_has_the_option() -> None:
    reporting = {"inspect", "check", "collapse", "diff", "simulate", "run"}
    having = {name for name, command in commands() if any(each.name == "depfile" for each in command.params)}
    assert {name for name, _ in commands()} - having == reporting


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_runs_the_command_again_when_a_buffer_changes(character: Path) -> None:
    line = "gltf-anim trim 'in dir/CesiumMan.gltf' out.glb --to 1 --depfile out.d"
    Path("Makefile").write_text(f"out.glb:\n\t{line}\n-include out.d\n")
    assert "gltf-anim trim" in _built("make")
    assert "up to date" in _built("make")
    _change(character.with_name("CesiumMan_data.bin"))
    assert "gltf-anim trim" in _built("make")


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_goes_on_when_an_input_is_gone(folder: Path) -> None:
    """The files of earlier versions end with "No rule to make target"."""
    line = "gltf-anim convert noop.glb out.glb --depfile out.d"
    Path("Makefile").write_text(f"out.glb:\n\t{line}\n-include out.d\n")
    _built("make")
    (folder / "noop.glb").rename("walk.glb")
    Path("Makefile").write_text(Path("Makefile").read_text().replace("noop.glb", "walk.glb"))
    assert "walk.glb" in _built("make")


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_reads_a_rule_of_names_with_colons(folder: Path) -> None:
    """A colon without a backslash ends with "target pattern contains no '%'"."""
    (folder / "noop.glb").rename("walk:1.glb")
    line = "gltf-anim convert walk:1.glb out.glb --depfile out.d"
    Path("Makefile").write_text(f"out.glb:\n\t{line}\n-include out.d\n")
    _built("make")
    assert "up to date" in _built("make")
    _change(Path("walk:1.glb"))
    assert "gltf-anim convert" in _built("make")


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_reads_a_rule_of_names_with_percent_signs(folder: Path) -> None:
    """A target with one is a pattern rule, whose inputs make forgets; among inputs a backslash would stay."""
    (folder / "noop.glb").rename("50%.glb")
    line = "gltf-anim convert 50%.glb out%.glb --depfile out.d"
    Path("Makefile").write_text(f"all: out%.glb\nout\\%.glb:\n\t{line}\n-include out.d\n")
    _built("make")
    assert Path("out.d").read_text() == "out\\%.glb: 50%.glb\n50\\%.glb:\n"
    assert "Nothing to be done" in _built("make")
    _change(Path("50%.glb"))
    assert "gltf-anim convert" in _built("make")
    (folder / "50%.glb").rename("60%.glb")
    Path("Makefile").write_text(Path("Makefile").read_text().replace("50%", "60%"))
    assert "60%" in _built("make")


@pytest.mark.skipif(shutil.which("ninja") is None, reason="ninja is not installed")
def test_ninja_runs_the_command_again_when_a_buffer_changes(character: Path) -> None:
    line = "gltf-anim trim $in $out --to 1 --depfile $out.d"
    text = f"rule trim\n  command = {line}\n  depfile = $out.d\n  deps = gcc\n"
    Path("build.ninja").write_text(text + "build out.glb: trim in$ dir/CesiumMan.gltf\n")
    assert "trim" in _built("ninja", "-v")
    assert "no work to do" in _built("ninja")
    _change(character.with_name("CesiumMan_data.bin"))
    assert "no work to do" not in _built("ninja")


def _built(*words: str) -> str:
    run = subprocess.run(words, env=ENVIRONMENT, capture_output=True, text=True, timeout=60, check=True)
    return run.stdout


def _change(path: Path) -> None:
    """Give a file a later modification time."""
    os.utime(path, (time.time() + 5, time.time() + 5))
