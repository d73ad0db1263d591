"""Outputs that can't be written are named before any work, in dry runs too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import typer

from cli import main
from cli.command_table import COMMANDS
from tests.cli.conftest import Call
from tests.cli.running import built, refusal


@pytest.mark.parametrize("command", [["convert"], ["resample", "--fps=3"], ["sample"]])
def test_outputs_that_cannot_be_written_are_named_before_any_work(
    command: list[str], call: Call, tmp_path: Path
) -> None:
    name, *rest = command
    lost = tmp_path / "lost.glb"  # would be named
    missing, kind = tmp_path / "no" / "out.json", tmp_path / "a.json"
    kind.mkdir()
    assert "out.json: there is no folder" in refusal(call(name, lost, missing, *rest), 3)
    assert "is a folder (expected a file name)" in refusal(call(name, lost, kind, *rest), 2)
    assert "the output has an empty name" in refusal(call(name, lost, "", *rest), 2)


DRY_RUNS = (
    "bake lost.glb no/out.npz",
    "convert lost.glb no/out.gltf",
    "convert lost.glb no/out.usdz",
    "convert-cache lost.npz no/out.pc2",
    "ease lost.glb no/out.glb",
    "from-euler lost.bvh no/out.glb",
    "loop lost.glb no/out.glb",
    "optimize lost.glb no/out.glb",
    "resample lost.glb no/out.glb --fps 3",
    "retime lost.glb no/out.glb --speed 2",
    "simulate cloth lost.glb no/out.glb --mesh flag",
    "simulate particles lost.glb no/out.glb --node head",
    "simulate particles lost.glb no/out.npz --node head",
    "simulate rigid lost.glb no/out.glb",
    "simulate springs lost.glb no/out.glb",
    "spline lost.glb no/out.glb",
    "to-euler lost.glb no/out.bvh",
    "trim lost.glb no/out.glb --to 1",
)


@pytest.mark.parametrize("line", DRY_RUNS)
def test_a_dry_run_names_a_missing_folder_too(line: str, call: Call) -> None:
    assert "there is no folder 'no'" in refusal(call(*line.split(), "--dry-run"), 3)


def test_dry_runs_are_all_tried() -> None:
    """A command with --dry-run is in the list above; check has no OUT."""
    group: Any = typer.main.get_command(main.app)
    dry = {name for name in COMMANDS if _has_dry_run(group.get_command(None, name))}
    assert dry - {line.split()[0] for line in DRY_RUNS} == {"check"}


def _has_dry_run(command: Any) -> bool:
    kinds = [command.get_command(None, kind) for kind in getattr(command, "table", ())]
    return any(param.name == "dry_run" for each in (command, *kinds) for param in each.params)


@pytest.mark.parametrize("ending", ["json", "csv", "npz", "fbx", "BIN", "pc2"])
def test_gltf_is_not_written_under_the_name_of_another_format(ending: str, call: Call, tmp_path: Path) -> None:
    out = tmp_path / f"out.{ending}"
    run = call("convert", "-", out, stdin=built("arm"))
    assert f"glTF is no .{ending.lower()} (expected .glb, .gltf, " in refusal(run, 2)
    assert not out.exists()
    call("convert", "-", tmp_path / "out.vrm", stdin=built("arm")).product()


def test_read_only_files_are_not_replaced(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out.glb"
    out.write_bytes(b"precious")
    monkeypatch.setattr("os.access", lambda *_: False)  # tests may run as root, who may write everything
    assert f"{out}: is read-only" in refusal(call("convert", "-", out, stdin=built("arm")), 3)
    assert out.read_bytes() == b"precious"


def test_names_that_no_file_can_have_are_refused_in_one_line(call: Call, tmp_path: Path) -> None:
    long = "y" * 300
    for command, *outputs in (["inspect"], ["from-euler", "-"], ["convert-cache", "-"]):
        run = call(command, tmp_path / f"{long}.npz", *outputs)
        assert "can't be read (file name too long)" in refusal(run, 3)
    for line, ending in ((["convert"], "glb"), (["bake", "--clip", "bend"], "npz")):
        run = call(*line, "-", tmp_path / f"{long}.{ending}", stdin=built("arm"))
        assert "can't be written (file name too long)" in refusal(run, 2)


@pytest.mark.parametrize(("line", "ending"), [(["convert"], "glb"), (["bake", "--clip", "bend", "--fps", "4"], "npz")])
def test_the_longest_name_that_a_file_can_have_is_written(
    line: list[str], ending: str, call: Call, tmp_path: Path
) -> None:
    """Its temporary neighbor's name must not be longer."""
    out = tmp_path / f"{'y' * (254 - len(ending))}.{ending}"
    call(*line, "-", out, stdin=built("arm")).product()
    assert out.is_file()
    assert list(tmp_path.iterdir()) == [out]
