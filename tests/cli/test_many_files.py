"""Commands on many files: an output for each, by --out."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, help_line, refusal

COMMANDS = (
    ("resample", "--fps", "30"),
    ("optimize", "--effort", "fast"),
    ("trim", "--from", "0.1"),
    ("ease",),
    ("spline",),
    ("retime", "--speed", "2"),
    ("convert",),
)


def outputs(folder: Path) -> set[str]:
    """Names of the files below a folder."""
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def crowd(folder: Path) -> Path:
    """A broken file and two sound ones, in folders below "in"."""
    (folder / "crowd").rename(folder / "in")
    (folder / "in" / "b").mkdir()
    (folder / "in" / "b" / "tube.glb").write_bytes(built("interpolations"))
    (folder / "in" / "a broken.glb").write_bytes(b"no glTF")
    return folder


@pytest.mark.parametrize("words", COMMANDS)
@pytest.mark.parametrize("inputs", [("in",), ("in/**/*.glb",)])
def test_a_failing_file_is_named_and_the_rest_finishes(
    words: tuple[str, ...], inputs: tuple[str, ...], crowd: Path, call: Call
) -> None:
    command, *options = words
    run = call(command, *inputs, "-o", "out/{path}", *options)
    assert (run.code, run.text) == (3, "")
    assert "gltf-anim: in/a broken.glb: is no glTF" in run.err
    assert run.err.endswith("3 files, 1 failed\n")
    assert outputs(crowd / "out") == {"arm 1.glb", "b/tube.glb"}
    single = call(command, "in/arm 1.glb", "-", *options).product()
    assert (crowd / "out" / "arm 1.glb").read_bytes() == single


def test_a_refused_output_is_named_and_the_rest_finishes(crowd: Path, call: Call) -> None:
    (crowd / "in" / "a broken.glb").unlink()
    (crowd / "out" / "arm 1.glb").mkdir(parents=True)
    run = call("resample", "in", "-o", "out/{path}", "--fps", "30")
    assert run.code == 2
    assert "gltf-anim: out/arm 1.glb: is a folder (expected a file name)\n" in run.err
    assert run.err.endswith("2 files, 1 failed\n")
    assert outputs(crowd / "out") == {"b/tube.glb"}


def test_an_output_that_leads_to_an_input_is_refused_alone(crowd: Path, call: Call) -> None:
    (crowd / "in" / "a broken.glb").unlink()
    (crowd / "out").mkdir()
    (crowd / "out" / "arm 1.gltf").symlink_to("../in/arm 1.glb")
    before = (crowd / "in" / "arm 1.glb").read_bytes()
    run = call("resample", "in", "-o", "out/{folder}/{stem}.gltf", "--fps", "30")
    assert (run.code, run.err.splitlines()[-1]) == (2, "2 files, 1 failed")
    assert (crowd / "in" / "arm 1.glb").read_bytes() == before
    assert (crowd / "out" / "b" / "tube.gltf").exists()


def test_folders_for_files_that_fail_do_not_stay(crowd: Path, call: Call) -> None:
    assert call("retime", "in", "--speed", "2", "-o", "made/{stem}/a.glb").code == 3
    assert outputs(crowd / "made") == {"arm 1/a.glb", "tube/a.glb"}
    assert not (crowd / "made" / "a broken").exists()


def test_loops_of_a_folder_are_closed_by_a_recipe(crowd: Path, call: Call) -> None:
    run = call("loop", "in", "out.glb")
    assert "in: is a folder (expected a file)" in refusal(run, 2)
    assert help_line(run) == 'a recipe closes loops of many files: steps = ["loop"], then gltf-anim run'


def test_names_are_those_of_the_shell_too(crowd: Path, call: Call) -> None:
    files = ["in/arm 1.glb", "in/b/tube.glb", "noop.glb"]
    assert call("resample", *files, "--out", "out/", "--fps", "24").code == 0
    assert outputs(crowd / "out") == {"arm 1.glb", "tube.glb", "noop.glb"}
    assert call("resample", *files, "-o", "{stem}-24.gltf", "--fps", "24", "-q").err.count("warning") == 1
    assert {"arm 1-24.gltf", "tube-24.gltf", "noop-24.gltf"} <= outputs(crowd)


def test_outputs_of_an_earlier_run_are_no_inputs(crowd: Path, call: Call) -> None:
    (crowd / "in" / "a broken.glb").unlink()
    for _ in range(2):
        assert call("resample", ".", "-o", "out/{path}", "--fps", "24").code == 0
        assert outputs(crowd / "out") == {"noop.glb", "in/arm 1.glb", "in/b/tube.glb"}


def test_files_are_replaced_in_place(crowd: Path, call: Call) -> None:
    (crowd / "in" / "a broken.glb").unlink()
    expected = call("resample", "in/arm 1.glb", "-", "--fps", "24").product()
    assert call("resample", "in", "-o", "in/{path}", "--fps", "24").code == 0
    assert (crowd / "in" / "arm 1.glb").read_bytes() == expected
    assert outputs(crowd / "in") == {"arm 1.glb", "b/tube.glb"}


def test_a_dry_run_writes_nothing(crowd: Path, call: Call) -> None:
    assert call("resample", "in/b", "-o", "out/{path}", "--fps", "24", "--dry-run").code == 0
    assert not (crowd / "out").exists()


@pytest.mark.parametrize(
    ("words", "code", "problem"),
    [
        (("in", "-o", "one.glb"), 2, "'in/a broken.glb' and 'in/arm 1.glb' have the same output, 'one.glb'"),
        (("noop.glb", "in/arm 1.glb", "-o", "in/arm 1.glb"), 2, "have the same output"),
        (("noop.glb", "in/b/tube.glb", "-o", "in/b/{name}"), 0, ""),
        (("in/b/tube.glb", "-o", "noop.glb", "noop.glb"), 2, "have the same output"),
        (("-", "-o", "out/{path}"), 2, "stdin has no name for --out: name files"),
        (("in", "-o", "out/{clip}.glb"), 2, "{clip} stands for nothing (expected {path} or {folder}"),
        (("in", "-o", "out/{stem}.fbx"), 2, "glTF is no .fbx"),
        (("in", "-o", ""), 2, "--out has an empty name"),
        (("none", "-o", "out/{path}"), 3, "none: can't be read"),
        (("*.gltf", "-o", "out/{path}"), 3, "*.gltf: matches no file"),
        (("noop.glb", "x.glb", "y.glb"), 2, "got unexpected extra argument (y.glb)"),
    ],
)
def test_wrong_names_are_refused_before_any_work(
    words: tuple[str, ...], code: int, problem: str, crowd: Path, call: Call
) -> None:
    run = call("resample", *words, "--fps", "30")
    assert run.code == code, run.err
    assert problem in run.err
    assert code == 0 or outputs(crowd) == {"noop.glb", "in/arm 1.glb", "in/b/tube.glb", "in/a broken.glb"}


def test_an_output_is_never_the_input_of_another_file(crowd: Path, call: Call) -> None:
    (crowd / "noop2.glb").write_bytes(built("arm"))
    run = call("resample", "noop.glb", "noop2.glb", "-o", "{stem}2.glb", "--fps", "30")
    problem = "the output of 'noop.glb' would replace 'noop2.glb', which is an input too"
    assert (run.code, run.err) == (2, f"gltf-anim: {problem}\n")
    assert (crowd / "noop2.glb").read_bytes() == built("arm")


@pytest.mark.parametrize("option", ["--report", "--curve"])
def test_options_about_one_file_are_refused(option: str, crowd: Path, call: Call) -> None:
    run = call("optimize", "in", "-o", "out/{path}", option, "x.csv")
    assert (run.code, run.err) == (2, f"gltf-anim: {option} is about one file: leave out --out\n")


@pytest.mark.parametrize(
    "command", ["resample --fps 12", "optimize --max-error 1mm", "trim --from 0.1", "convert", "ease"]
)
@pytest.mark.parametrize("output", [(), ("out",)])
def test_a_folder_without_out_is_named_with_the_option(
    command: str, output: tuple[str, ...], folder: Path, call: Call
) -> None:
    name, *options = command.split()
    run = call(name, "crowd", *output, *options)
    assert "crowd: is a folder (expected a file)" in refusal(run, 2)
    assert help_line(run) == "all its files: -o 'out/{path}'"
